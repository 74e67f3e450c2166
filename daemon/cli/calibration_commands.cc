#include "daemon/cli/calibration_commands.h"

#include <CLI/CLI.hpp>
#include <functional>

#include "daemon/cli/become.h"
#include "daemon/cli/error_report.h"

namespace opaline::daemon {
namespace {

Error become_calibrate(const std::filesystem::path& programs,
                       const CalibrateWish& wish,
                       const CalibrationPlace& place) {
  std::vector<std::string> words{"--calibrations", place.root.string()};
  if (!wish.step.empty()) words.insert(words.end(), {"--step", wish.step});
  if (wish.resume) words.emplace_back("--resume");
  if (wish.attended) words.emplace_back("--attended");
  if (!wish.view.empty())
    words.insert(words.end(), {"--view", wish.view, "--frames", std::to_string(wish.frames)});
  words.insert(words.end(), {"--", wish.rig});
  return become(programs, "opaline-calibrate", words);
}

void declare_place(CLI::App& command, CalibrationPlace& place) {
  command.add_option("--calibrations", place.root, "Directory of all calibrations")
      ->capture_default_str();
}

}  // namespace

void CalibrationCommands::declare(CLI::App& app,
                                  const std::filesystem::path& programs,
                                  int& status) {
  declare_calibrate(app, programs, status);
  declare_calibration(app, status);
}

void CalibrationCommands::declare_calibrate(CLI::App& app,
                                            const std::filesystem::path& programs,
                                            int& status) {
  CLI::App* sub = app.add_subcommand(
      "calibrate", "Let a station measure its camera and projector before it measures a sample");
  sub->add_option("RIG", wish_.rig, "rig.toml")->required();
  sub->add_option(
      "--step",
      wish_.step,
      "One step only: warm_up, black_level, linearity, radiometric, geometry, check; or colour");
  sub->add_flag("--resume", wish_.resume, "Go on with the newest unfinished one");
  sub->add_flag("--attended",
                wish_.attended,
                "Wait for a person to move the board also before a simulated station");
  auto* const view = sub->add_option(
      "--view", wish_.view, "A viewfinder instead: view.png and view.json in this directory");
  sub->add_option("--frames", wish_.frames, "With --view: end after so many; 0: Ctrl-C ends it")
      ->check(CLI::NonNegativeNumber)
      ->needs(view);
  declare_place(*sub, place_);
  sub->footer(
      "Each step has gates; the first that fails ends it and names what to mend. What is measured: "
      "docs/calibration.md\nExit status: 0 done, 1 refused or failed, 2 bad input, 3 stopped, 4 "
      "station busy\n\nExamples:\n"
      "  opaline calibrate config/sim-rig.toml\n"
      "  opaline calibrate --resume config/sim-rig.toml\n"
      "  opaline calibrate --step black_level config/sim-rig.toml\n"
      "  opaline calibrate --view /tmp/view config/sim-rig.toml\n"
      "  opaline calibrate --attended config/sim-boards.toml       lenses, by a board that "
      "somebody holds\n"
      "  opaline calibrate --step colour config/sim-rig-chart.toml");
  sub->callback(
      [this, &programs, &status] { status = report(become_calibrate(programs, wish_, place_)); });
}

void CalibrationCommands::declare_calibration(CLI::App& app, int& status) {
  CLI::App* group =
      app.add_subcommand("calibration", "The calibrations of a station, and which one is used");
  group->require_subcommand(1);
  group->fallthrough();
  declare_place(*group, place_);
  group->add_option("--station", place_.station, "Where there are several: [station] name");
  const auto add = [&status, group](
                       const char* name, const char* help, std::function<Result<void>()> action) {
    CLI::App* sub = group->add_subcommand(name, help);
    sub->callback([&status, action = std::move(action)] { status = report(action()); });
    return sub;
  };
  add("list", "All, with the one in use", [this] { return list_calibrations(place_); });
  add("show",
      "One with its steps, gates and figures",
      [this] { return show_calibration(place_, versions_.empty() ? 0 : versions_[0]); })
      ->add_option("VERSION", versions_, "Default: the active one")
      ->expected(0, 1);
  add("activate",
      "Use this one from now on, also an older one",
      [this] { return activate_calibration(place_, versions_[0]); })
      ->add_option("VERSION", versions_, "As \"opaline calibration list\" has it")
      ->required()
      ->expected(1);
  add("rollback", "Use the one again that was in use before", [this] {
    return roll_back_calibration(place_);
  });
  add("diff",
      "What changed between two",
      [this] { return diff_calibrations(place_, versions_[0], versions_[1]); })
      ->add_option("BEFORE AFTER", versions_, "Two versions")
      ->required()
      ->expected(2);
  group->footer(
      "Examples:\n  opaline calibration list\n  opaline calibration show 3\n  opaline calibration "
      "rollback\n  opaline calibration activate 2\n  opaline calibration diff 2 3");
}

}  // namespace opaline::daemon
