#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/camera_model.h"
#include "base/dataset.h"
#include "base/material.h"
#include "config/session_config.h"
#include "daemon/preview/session_object.h"
#include "daemon/report/error_sums.h"
#include "daemon/report/hdr_picture.h"
#include "daemon/report/relighting.h"
#include "daemon/report/shown_colors.h"
#include "daemon/report/stage_times.h"
#include "daemon/report/surface_view.h"

namespace opaline::daemon {

/// A light's HDR picture, made small.
struct ContactPicture {
  std::string name;
  Image<float> radiance;
  Image<std::uint8_t> saturated;
  double saturated_share = 0.0;  ///< of all pixels
};

/// A plot as it stands in the page, or why it could not be drawn.
struct DrawnPlot {
  std::string place;    ///< the section that shows it
  std::string caption;  ///< text
  std::string svg;      ///< an SVG element; empty: see `absent`
  std::string absent;
};

/// Everything the report and results.json show.
struct ReportData {
  std::string session_id;
  std::string generator;  ///< "opaline-preview 0.1.0"
  config::SessionConfig config;
  CameraModel camera;  ///< that the pictures were taken with, as measured
  Dataset dataset;
  Material material;
  std::optional<Material> truth;  ///< of a simulated sample
  nlohmann::json reconstruction;  ///< reconstruction.json
  std::vector<ContactPicture> contacts;
  std::vector<RelitLight> lights;      ///< the held-out ones that could be used; may be none
  std::vector<SurfaceFit> fits;        ///< all
  std::optional<SurfaceView> surface;  ///< where the session has a picture under uniform light
  std::optional<ObjectView> object;    ///< where the session asks for one
  std::vector<DrawnPlot> plots;
  std::optional<ChannelErrors> bssrdf;
  std::string bssrdf_absent;  ///< why there is no BSSRDF error
  SessionFacts facts;
  std::optional<ShownColors> colors;  ///< none: pictures are in the camera's own
  std::string solver;
  std::string renderer;
  double white = 1.0;       ///< shown as white
  double difference = 0.1;  ///< share of white at the ends of the difference pictures' scale

  /// Radiance as its pictures are drawn from: corrected, where there is a correction.
  Image<float> shown(const Image<float>& radiance) const {
    return colors ? colors->apply(radiance) : radiance;
  }
  /// Over all held-out lights.
  ChannelErrors relighting() const {
    ChannelErrors sum;
    for (const RelitLight& light : lights) sum.add(light.errors);
    return sum;
  }
  /// Over all lights, on the sample's surface.
  ChannelErrors fit() const {
    ChannelErrors sum;
    for (const SurfaceFit& light : fits) sum.add(light.errors);
    return sum;
  }
};

/// What was taken for granted, as (what, value).
std::vector<std::pair<std::string, std::string>> assumptions(const ReportData& data);

}  // namespace opaline::daemon
