#include "daemon/report/plot_sheet.h"

#include <fmt/format.h>

#include <utility>

#include "base/log.h"
#include "daemon/report/model_section.h"
#include "daemon/report/report_plots.h"
#include "daemon/report/uncertainty_section.h"

namespace opaline::daemon {
namespace {

struct Order {
  std::string place;
  std::string caption;
  std::function<Result<std::string>(std::string_view name, std::stop_token stop)> draw;
};

template <class Plot>
Order order(std::string place, std::string caption, Plot plot) {
  return {std::move(place),
          std::move(caption),
          [plot = std::move(plot)](std::string_view name, std::stop_token stop) {
            return draw(plot, name, std::move(stop));
          }};
}

std::vector<Order> orders_for(const ReportData& data) {
  std::vector<Order> orders;
  if (!data.lights.empty()) {
    orders.push_back(order("relighting",
                           "Scale of the difference pictures",
                           ScalePlot{"relit minus captured, % of white",
                                     -100.0 * data.difference,
                                     100.0 * data.difference}));
  }
  orders.push_back(
      order("fit", "Relative error on the sample's surface, light by light", fit_plot(data)));
  for (const auto& [held_out, caption] :
       {std::pair{false, "Residuals of the lights that were fitted"},
        {true, "Residuals of the lights that were not"}}) {
    MapPlot plot = residual_plot(data, held_out);
    if (!plot.panels.empty()) orders.push_back(order("fit", caption, std::move(plot)));
  }
  orders.push_back(order(
      "convergence", "Misfit over measured variance and model error", convergence_plot(data)));
  if (const auto plot = ladder_plot(data.reconstruction))
    orders.push_back(order("model", "Held-out misfit of the models tried", *plot));
  for (const Coefficient coefficient : kCoefficients) {
    for (int c = 0; c < kColorChannels; ++c) {
      orders.push_back(order(std::string(place_of(coefficient)),
                             fmt::format("{}, {}", title_of(coefficient), kChannelNames[c]),
                             slices_plot(data, coefficient, c)));
    }
  }
  for (auto& [caption, plot] : uncertainty_plots(data.reconstruction))
    orders.push_back(order("uncertainty", caption, std::move(plot)));
  return orders;
}

}  // namespace

Result<std::vector<DrawnPlot>> draw_plots(const ReportData& data,
                                          const std::function<void(double)>& drawn,
                                          std::stop_token stop) {
  std::vector<DrawnPlot> plots;
  const std::vector<Order> orders = orders_for(data);
  for (const Order& order : orders) {
    const auto svg = order.draw(fmt::format("plot{}", plots.size() + 1), stop);
    if (!svg && stop.stop_requested()) return svg.error();
    if (!svg) log::warning("plot \"{}\": {}", order.caption, svg.error().message);
    plots.push_back({order.place, order.caption, svg ? *svg : "", svg ? "" : svg.error().message});
    drawn(static_cast<double>(plots.size()) / static_cast<double>(orders.size()));
  }
  return plots;
}

}  // namespace opaline::daemon
