#pragma once

#include <filesystem>
#include <string>

#include "base/files.h"
#include "base/result.h"

namespace opaline {

/// The names inside a session directory, and the version of their layout
/// (docs/session-directory.md).
class SessionDirectory {
 public:
  static constexpr int kFormat = 1;  ///< written to session.json; a higher one is refused

  /// What a session is made from; each text becomes a file.
  struct Contents {
    std::string name;           ///< for people
    std::string session_toml;   ///< as given
    std::string rig_toml;       ///< as given
    std::string resolved_toml;  ///< with every default filled in
  };

  /// Makes the directory; session.json is written last, so a half-made one is not a session. kBusy
  /// when it exists.
  static Result<SessionDirectory> create(FileOperations& files,
                                         const std::filesystem::path& path,
                                         const Contents& contents);
  /// Errors: kNotFound when there is no session; kInvalidArgument when a newer version wrote it.
  static Result<SessionDirectory> open(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  const std::string& name() const { return name_; }
  std::string id() const { return path_.filename().string(); }
  std::filesystem::path session_toml() const { return path_ / "session.toml"; }
  std::filesystem::path rig_toml() const { return path_ / "rig.toml"; }
  std::filesystem::path resolved_toml() const { return path_ / "resolved.toml"; }
  std::filesystem::path events() const { return path_ / "events.jsonl"; }
  std::filesystem::path lock() const { return path_ / "lock"; }
  std::filesystem::path control_socket() const { return path_ / "control.sock"; }
  std::filesystem::path frames() const { return path_ / "frames"; }
  std::filesystem::path calibration() const { return path_ / "calibration" / "calibration.json"; }
  std::filesystem::path hdr() const { return path_ / "hdr"; }
  std::filesystem::path checkpoint() const { return path_ / "checkpoint"; }
  std::filesystem::path material() const { return path_ / "material.vdb"; }
  std::filesystem::path surface() const { return path_ / "surface_reflectance.exr"; }
  std::filesystem::path reconstruction() const { return path_ / "reconstruction.json"; }
  std::filesystem::path preview() const { return path_ / "preview"; }
  std::filesystem::path report() const { return path_ / "report.html"; }
  std::filesystem::path results() const { return path_ / "results.json"; }

 private:
  SessionDirectory(std::filesystem::path path, std::string name)
      : path_(std::move(path)), name_(std::move(name)) {}
  std::filesystem::path path_;
  std::string name_;
};

}  // namespace opaline
