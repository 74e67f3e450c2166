#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace opaline::faults {

/// A job's program at work on a session; killed at the end of the scope if it still runs.
class JobProcess {
 public:
  static Result<std::unique_ptr<JobProcess>> start(const std::filesystem::path& program,
                                                   const std::filesystem::path& session,
                                                   const std::filesystem::path& log);
  ~JobProcess();
  JobProcess(const JobProcess&) = delete;
  JobProcess& operator=(const JobProcess&) = delete;

  /// The exit status, 128 + n for signal n. kTimeout when it runs on, and keeps running.
  Result<int> wait(std::chrono::nanoseconds patience);
  void kill();
  pid_t pid() const { return pid_; }

 private:
  explicit JobProcess(pid_t pid) : pid_(pid) {}
  pid_t pid_;
  std::optional<int> status_;
};

/// A directory of tiny sessions on one tiny simulated station, which runs as opaline-rig: 2 x 2 regions and two
/// held-out lights on a block of 8 x 8 x 4 cells seen by 64 x 64 pixels. Everything lies in a temporary directory, and
/// the rig ends with it.
class FaultBed {
 public:
  struct Options {
    std::filesystem::path programs;  ///< where opaline-capture and the others are
    int time_factor = 1000;
  };
  static Result<std::unique_ptr<FaultBed>> create(const Options& options);
  ~FaultBed();
  FaultBed(const FaultBed&) = delete;
  FaultBed& operator=(const FaultBed&) = delete;

  Result<std::filesystem::path> new_session();
  Result<std::unique_ptr<JobProcess>> start(const std::string& program,
                                            const std::filesystem::path& session) const;
  /// Runs a job to its end; its log's tail is in the error when the status is not 0.
  Result<void> complete(const std::string& program, const std::filesystem::path& session) const;
  /// Starts a job, kills it after so long, and starts it again to its end. Whether the kill met it alive.
  Result<bool> kill_and_complete(const std::string& program,
                                 const std::filesystem::path& session,
                                 std::chrono::nanoseconds after) const;
  std::filesystem::path rig_socket() const { return root_ / "rig.sock"; }
  const std::filesystem::path& root() const { return root_; }

 private:
  FaultBed(Options options, std::filesystem::path root)
      : options_(std::move(options)), root_(std::move(root)) {}
  std::filesystem::path log_of(const std::filesystem::path& session) const;
  Options options_;
  std::filesystem::path root_;
  int sessions_ = 0;
};

/// The files below some entries of a session, as "relative path, bytes", sorted.
using FileList = std::vector<std::pair<std::string, std::vector<std::byte>>>;
Result<FileList> contents_of(const std::filesystem::path& session,
                             const std::vector<std::string>& entries);

/// hdr/ and the dataset: what must come out the same whatever happened on the way.
Result<FileList> capture_results(const std::filesystem::path& session);

/// `count` moments of a run of `length`, one at random in each of as many equal parts, by the seed.
std::vector<std::chrono::nanoseconds> moments(std::chrono::nanoseconds length,
                                              int count,
                                              std::uint64_t seed);

}  // namespace opaline::faults
