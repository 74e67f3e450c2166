#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "base/dataset.h"
#include "base/files.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/inverse_result.h"
#include "reconstruct/lbfgs.h"

namespace opaline::reconstruct {

/// A channel under way: what the next step depends on, and its history so far.
struct ChannelProgress {
  LbfgsState state;
  ChannelReport report;
};

/// A channel on its way up the ladder of models (reconstruct/model_ladder.h).
struct LadderProgress {
  ChannelReport report;      ///< of the rungs so far; its history is that of those taken
  std::vector<double> best;  ///< cell values of the last one taken; empty: none yet
  bool finishing = false;  ///< the choice is made, the chosen model is fitted to all illuminations
  bool correcting =
      false;  ///< finishing with what the grid leaves out at `best` taken off the pictures
  std::optional<ChannelProgress> current;  ///< of the rung under way
};

/// The three channels on their way to one structure (reconstruct/shared_structure.h).
struct SharedProgress {
  LbfgsState state;
  std::array<ChannelReport, kColorChannels> channels;
};

/// All that a reconstruction needs to go on as if it had not stopped.
struct Checkpoint {
  struct Finished {
    ChannelCoefficients coefficients;
    ChannelReport report;
  };
  std::array<std::optional<Finished>, kColorChannels> finished;
  std::optional<LadderProgress> current;  ///< of the first channel that is not finished
  std::optional<SharedProgress> shared;   ///< of all channels together; then none is finished
};

/// SHA-256 over the dataset and every option that the result depends on.
std::string fingerprint(const Dataset& dataset, const InverseOptions& options);

/// Keeps the checkpoint of one reconstruction in `directory`/reconstruction.checkpoint, written
/// whole: a checksum, then CBOR.
class CheckpointStore {
 public:
  CheckpointStore(FileOperations& files, std::filesystem::path directory, std::string fingerprint);

  /// The last one saved; an empty one when there is none, or when it is damaged, of another version
  /// or of another fingerprint (it says so in the log): starting again is always right.
  Checkpoint load() const;
  Result<void> save(const Checkpoint& checkpoint) const;

 private:
  std::filesystem::path path() const { return directory_ / "reconstruction.checkpoint"; }
  FileOperations& files_;
  std::filesystem::path directory_;
  std::string fingerprint_;
};

}  // namespace opaline::reconstruct
