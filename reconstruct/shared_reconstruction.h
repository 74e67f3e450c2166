#pragma once

#include <array>
#include <functional>
#include <optional>
#include <stop_token>

#include "base/clock.h"
#include "base/dataset.h"
#include "reconstruct/checkpoint.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"

namespace opaline::reconstruct {

/// Whether the options ask for one structure of all channels: Structure::kShared, where cells may vary at all.
bool asks_for_shared_structure(const InverseOptions& options);

/// The three channels as one structure (reconstruct/shared_structure.h), from their homogeneous fits.
///
/// With Model::kAuto it is judged as a rung of the ladder (reconstruct/model_ladder.h) over the held-out data of all
/// channels: nothing comes back where homogeneous channels are explained or the shared structure gains nothing significant;
/// the channels then climb each by itself.
///
/// Hooks: after every iteration, and every options.checkpoint_every of them. Errors: make_channel_problem's, the
/// solver's, the hook's; kCancelled.
struct SharedHooks {
  std::function<void(const ChannelReport&)> iterated;
  std::function<Result<void>(const SharedProgress&)> checkpoint;
};
using FinishedChannels = std::array<Checkpoint::Finished, kColorChannels>;
Result<std::optional<FinishedChannels>> reconstruct_shared(const Dataset& dataset,
                                                           const InverseOptions& options,
                                                           diffusion::FluenceSolver& solver,
                                                           const Clock& clock,
                                                           std::optional<SharedProgress> from,
                                                           const SharedHooks& hooks,
                                                           std::stop_token stop);

}  // namespace opaline::reconstruct
