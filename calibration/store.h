#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/result.h"
#include "calibration/record.h"

namespace opaline::calibration {

/// The calibrations of a station on disk:
///
///   ROOT/STATION/0001/calibration.json   a record, written whole after each of its steps
///   ROOT/STATION/active.json             which of them sessions use, and which they used before
///
/// Threads: one writer at a time, who holds the station's lock; readers see whole files.
class Store {
 public:
  /// `files` outlives us.
  Store(FileOperations& files, const std::filesystem::path& root, const std::string& station)
      : files_(files), directory_(root / station) {}

  std::vector<int> versions() const;  ///< sorted; incomplete ones, too
  std::filesystem::path directory_of(int version) const;
  /// Errors: kNotFound listing what there is; kInvalidArgument for a damaged or newer one.
  Result<Record> read(int version) const;
  Result<void> write(const Record& record) const;
  /// None when none was ever activated.
  Result<std::optional<int>> active() const;
  /// The active record; none when there is none.
  Result<std::optional<Record>> read_active() const;
  /// Lets sessions use this one from now on. Errors: kInvalidArgument for one that was not accepted, with what it failed.
  Result<void> activate(int version) const;
  /// The newest version below this one that sessions have used at some time; none where there is none.
  Result<std::optional<int>> used_before(int version) const;
  const std::filesystem::path& directory() const { return directory_; }

 private:
  FileOperations& files_;
  std::filesystem::path directory_;
};

/// The stations that a root has calibrations of.
std::vector<std::string> stations_in(const std::filesystem::path& root);

/// Whether a new record takes the place of the active one: it is accepted and not clearly worse, its margin being at most
/// 1.25 times the active one's and a tenth, since figures scatter. Of other devices the active one says nothing.
bool should_activate(const Record& fresh, const std::optional<Record>& active);

}  // namespace opaline::calibration
