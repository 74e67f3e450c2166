#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/report/plot.h"
#include "daemon/report/report_data.h"

namespace opaline::daemon {

enum class Coefficient : std::uint8_t { kAbsorption, kReducedScattering, kDiffusion };
inline constexpr std::array kCoefficients{
    Coefficient::kAbsorption, Coefficient::kReducedScattering, Coefficient::kDiffusion};
/// "absorption": where its plots stand in the report.
std::string_view place_of(Coefficient coefficient);
/// "Absorption σa"
std::string_view title_of(Coefficient coefficient);

/// chi^2 per datum against the iteration, one curve a channel.
CurvePlot convergence_plot(const ReportData& data);

/// Relative error of each light on the sample's surface, one bar a channel; the noise floor across.
BarPlot fit_plot(const ReportData& data);

/// Signed relative residual of each light that has data, over the seen face's cells: mean of the channels, over
/// the light's brightest cell (99.5 % quantile). Per cent.
MapPlot residual_plot(const ReportData& data, bool held_out);

/// A coefficient of one channel through the depth: cuts parallel to the seen face, from the lit
/// side to the camera's, and one across; below them the truth, where it is known.
MapPlot slices_plot(const ReportData& data, Coefficient coefficient, int channel);

}  // namespace opaline::daemon
