#pragma once

namespace opaline::bench {

/// Takes a simulated station through its whole calibration with a chessboard in 20 poses (config/sim-boards.toml), again with chessboards that
/// the projector shows in place of sinusoids (sim_chessboard), and again with seven of 21 poses out of focus or partly hidden, and prints what is left of the reprojection and how far lenses and lengths are from the truth. Whether
/// all went well; says what did not. Of several runs, each with noise and poses of its own, the median, and the worst as case NAME_worst.
bool print_geometry(int runs);

}  // namespace opaline::bench
