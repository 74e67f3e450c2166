#pragma once

#include <filesystem>

#include "daemon/cli/render.h"
#include "daemon/cli/tradeoff.h"
#include "daemon/cli/view.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace opaline::daemon {

/// `opaline tradeoff`, `opaline render` and `opaline view`: programs of their own, which `opaline` becomes.
class ProgramCommands {
 public:
  /// `programs` is where those are, looked at when a command is called; it, `status` and we outlive the parsing.
  void declare(CLI::App& app, const std::filesystem::path& programs, int& status);

 private:
  void declare_tradeoff(CLI::App& app, const std::filesystem::path& programs, int& status);
  void declare_render(CLI::App& app, const std::filesystem::path& programs, int& status);
  void declare_view(CLI::App& app, const std::filesystem::path& programs, int& status);

  TradeoffWish tradeoff_;
  RenderWish render_;
  ViewWish view_;
};

}  // namespace opaline::daemon
