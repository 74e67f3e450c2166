#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace opaline::capture {

/// A surface cell in one colour channel, as the camera's pixels on it see it.
struct CellLight {
  double rate = 0.0;          ///< electrons a second and pixel, of the light; >= 0
  double leak = 0.0;          ///< the same without the light: dark current, the projector's black
  double brightest = 0.0;     ///< both, of its brightest pixel
  double pixels = 1.0;        ///< 1 / sum w^2 of the pixels' weights in its mean
  double wanted_snr = 100.0;  ///< of their mean
};

/// Which exposures of one light are to be taken for the least time.
struct ExposureProblem {
  std::vector<double> seconds;  ///< that can be exposed, shortest first
  std::vector<int> taken;       ///< frames of each that there are already; empty: none
  std::vector<int> blacks;      ///< black frames of each; empty: one
  std::vector<std::array<CellLight, 3>> cells;
  double share =
      0.95;  ///< of the cells that must have what is wanted in all channels; 0 < share <= 1
  double read_variance =
      9.0;  ///< of one frame's pixel without light, quantisation included, electrons^2
  double clipping_electrons = 1e4;
  double most_seconds = 16.0;  ///< that may still be taken
};

struct ExposureAnswer {
  std::vector<int> frames;  ///< still to be taken, of each exposure; all 0: nothing
  double seconds = 0.0;     ///< of them
  double bound =
      0.0;  ///< no choice of frames takes less than this, or none at all within most_seconds
  bool reaches = false;  ///< the goal; where it is out of reach `frames` is empty
};

/// Which exposures, and how many of each, take least time. With r and l a cell's light and leak (electrons a second), b the
/// read variance and p its pixels, n frames of t seconds, less the mean of m black frames, tell it to
///
///   SNR^2(t, n) = p (r t)^2 / [((r + l) t + b) / n + (l t + b) / m]      0 where its brightest pixel clips
///
/// and frames of several t add up, being independent: the noise model of HdrMerge. Sought is the least sum n_k t_k under which
/// `share` of the cells have wanted_snr^2 in all channels. (Hasinoff, Durand, Freeman 2010 choose exposures by such a model for
/// the worst case over a range of light; here the light is known.)
///
/// Branch and bound over n_k, longest first. A cell that lacks SNR^2 of d needs at least d / max_k [dSNR^2_k / t_k] more
/// seconds, since SNR^2 is concave in n; the share's quantile of that over the cells bounds every completion from below. It
/// stops at what is proven to be within 1 % of the least, or after some thousand branches with the best found.
///
/// Threads: free function, nothing shared.
ExposureAnswer plan_exposures(const ExposureProblem& problem);

/// The share of the cells that have the wanted SNR with the frames taken.
double share_reached(const ExposureProblem& problem);

/// The least seconds of light under which photon noise alone, of the light and of what leaks, leaves `share` of the cells the
/// wanted SNR, with a camera that reads without noise, never clips, and knows its black: the share's quantile of
/// wanted_snr^2 (r + l) / (p r^2).
double photon_limit(const ExposureProblem& problem);

}  // namespace opaline::capture
