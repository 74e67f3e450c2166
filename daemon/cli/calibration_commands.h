#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/cli/calibration.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace opaline::daemon {

/// What is passed on to opaline-calibrate.
struct CalibrateWish {
  std::string rig;
  std::string step;
  bool resume = false;
  std::string view;
  int frames = 0;
  bool attended = false;
};

/// `opaline calibrate`, which becomes opaline-calibrate, and `opaline calibration`.
class CalibrationCommands {
 public:
  /// `root` of the calibrations of all stations, unless the command line names another.
  explicit CalibrationCommands(const std::filesystem::path& root) : place_{root, {}} {}
  /// `programs` is where opaline-calibrate is, looked at when it is called; it, `status` and we outlive the parsing.
  void declare(CLI::App& app, const std::filesystem::path& programs, int& status);

 private:
  void declare_calibrate(CLI::App& app, const std::filesystem::path& programs, int& status);
  void declare_calibration(CLI::App& app, int& status);

  CalibrateWish wish_;
  CalibrationPlace place_;
  std::vector<int> versions_;
};

}  // namespace opaline::daemon
