#include "daemon/cli/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

namespace opaline::daemon {

ProgressView::Options terminal_options() {
  ProgressView::Options options;
  options.terminal = ::isatty(STDOUT_FILENO) == 1;
  struct winsize size {};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
    options.columns = size.ws_col;
  }
  return options;
}

}  // namespace opaline::daemon
