#pragma once

#include <fmt/format.h>

#include <stop_token>
#include <string>
#include <string_view>

#include "daemon/report/html.h"
#include "daemon/report/plot.h"

namespace opaline::daemon {

/// A plot with its caption, or why it could not be drawn.
template <class Plot>
std::string figure(const Plot& plot,
                   std::string_view name,
                   std::string_view caption,
                   const std::stop_token& stop) {
  const auto drawn = draw(plot, name, stop);
  return drawn ? html::drawing(*drawn, caption)
               : html::warning(fmt::format("{}: {}", caption, drawn.error().message));
}

}  // namespace opaline::daemon
