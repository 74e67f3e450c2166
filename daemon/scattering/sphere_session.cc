#include "daemon/scattering/sphere_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/io/stage_record_io.h"

namespace opaline::daemon {
namespace {

using reconstruct::StagePictures;

bool has(const Image<std::uint8_t>& mask, int x, int y) {
  return x >= 0 && y >= 0 && x < mask.width() && y < mask.height() && mask.at(x, y) != 0;
}

/// Less what lies within `edge` pixels of the outside, by rows and then by columns.
Image<std::uint8_t> eroded(const Image<std::uint8_t>& mask, int edge) {
  Image<std::uint8_t> rows = mask;
  Image<std::uint8_t> result = mask;
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x)
      for (int d = -edge; d <= edge; ++d)
        if (!has(mask, x + d, y)) rows.at(x, y) = 0;
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x) {
      result.at(x, y) = rows.at(x, y);
      for (int d = -edge; d <= edge; ++d)
        if (!has(rows, x, y + d)) result.at(x, y) = 0;
    }
  return result;
}

Image<std::uint8_t> object_of(const HdrPicture& constant, double threshold) {
  Image<std::uint8_t> object(constant.radiance.width(), constant.radiance.height(), 1);
  for (int y = 0; y < object.height(); ++y)
    for (int x = 0; x < object.width(); ++x) {
      float sum = 0.0F;
      for (int c = 0; c < 3; ++c) sum += constant.radiance.at(x, y, c);
      object.at(x, y) =
          sum / 3.0F > static_cast<float>(threshold) || constant.saturated.at(x, y) != 0 ? 1 : 0;
    }
  return object;
}

Image<std::uint8_t> measured_in(const SphereSession& session,
                                const config::LedSphereOptions& options) {
  const double threshold = options.capture.object_threshold * white_radiance(session.record);
  Image<std::uint8_t> measured =
      eroded(object_of(session.pictures.at("constant"), threshold), options.edge_px);
  for (const auto& [name, picture] : session.pictures) {
    if (name == "constant_parallel" || name == "beam") continue;
    for (int y = 0; y < measured.height(); ++y)
      for (int x = 0; x < measured.width(); ++x) {
        std::uint8_t& pixel = measured.at(x, y);
        if (pixel == reconstruct::kNotSeen) continue;
        if (picture.saturated.at(x, y) != 0) {
          pixel = reconstruct::kClipped;
        } else if (picture.usable.at(x, y) == 0 && pixel == reconstruct::kMeasured) {
          pixel = reconstruct::kNotSeen;
        }
      }
  }
  return measured;
}

StagePictures::Picture picture_of(const SphereSession& session,
                                  const std::string& name,
                                  int channel) {
  const StagePicture& shown = *session.record.find(name);
  const HdrPicture& hdr = session.pictures.at(name);
  StagePictures::Picture picture{{}, {}, shown.codes};
  const auto scale = static_cast<float>(1.0 / shown.scale);
  for (int y = 0; y < hdr.radiance.height(); ++y)
    for (int x = 0; x < hdr.radiance.width(); ++x) {
      picture.radiance.push_back(scale * hdr.radiance.at(x, y, channel));
      picture.variance.push_back(scale * scale * hdr.variance.at(x, y, channel));
    }
  return picture;
}

std::vector<std::string> needed_pictures(bool split) {
  std::vector<std::string> names{"constant", "constant_again"};
  for (const char axis : {'x', 'y', 'z'}) {
    const std::string name = fmt::format("gradient_{}", axis);
    if (split) {
      names.push_back(name + "_plus");
      names.push_back(name + "_minus");
    } else {
      names.push_back(name);
    }
  }
  return names;
}

}  // namespace

std::size_t shining_lamps(const StageRecord& record) {
  return static_cast<std::size_t>(std::ranges::count_if(
      record.lights, [](const SphereLight& light) { return light.intensity > 0.0; }));
}

double white_radiance(const StageRecord& record) {
  return record.depolarised *
         reconstruct::surrounding_radiance(record.lights, record.find("constant")->codes);
}

Result<SphereSession> read_sphere_session(const SessionDirectory& directory,
                                          const config::LedSphereOptions& options) {
  auto record = read_stage_record(directory.path());
  if (!record) return record.error();
  SphereSession session{*std::move(record), {}, {}};
  for (const std::string& name : needed_pictures(session.record.split))
    if (session.record.find(name) == nullptr)
      return invalid_argument(fmt::format("light_stage.json: no picture \"{}\"", name));
  for (const StagePicture& shown : session.record.pictures) {
    auto picture = read_hdr_picture(directory.hdr() / (shown.name + ".exr"));
    if (!picture) return picture.error();
    const auto& first =
        session.pictures.empty() ? picture->radiance : session.pictures.begin()->second.radiance;
    if (picture->radiance.width() != first.width() || picture->radiance.height() != first.height())
      return invalid_argument(
          fmt::format("hdr/{}.exr has another size than the others", shown.name));
    session.pictures.emplace(shown.name, *std::move(picture));
  }
  session.measured = measured_in(session, options);
  return session;
}

StagePictures channel_pictures(const SphereSession& session, int channel) {
  StagePictures p;
  p.width = session.measured.width();
  p.height = session.measured.height();
  p.constant = picture_of(session, "constant", channel);
  const StagePictures::Picture again = picture_of(session, "constant_again", channel);
  for (std::size_t at = 0; at < p.constant.radiance.size(); ++at) {
    p.constant.radiance[at] = 0.5F * (p.constant.radiance[at] + again.radiance[at]);
    p.constant.variance[at] = 0.25F * (p.constant.variance[at] + again.variance[at]);
  }
  for (std::size_t a = 0; a < 3; ++a) {
    const std::string name = fmt::format("gradient_{}", "xyz"[a]);
    p.gradients[a] = picture_of(session, session.record.split ? name + "_plus" : name, channel);
    if (session.record.split) p.minuses.push_back(picture_of(session, name + "_minus", channel));
  }
  const auto measured = session.measured.samples();
  p.measured.assign(measured.begin(), measured.end());
  return p;
}

std::optional<Image<float>> specular_map(const SphereSession& session) {
  const StagePicture* shown = session.record.find("constant_parallel");
  if (shown == nullptr) return std::nullopt;
  const HdrPicture& parallel = session.pictures.at("constant_parallel");
  const HdrPicture& cross = session.pictures.at("constant");
  const double white = white_radiance(session.record);
  Image<float> map(parallel.radiance.width(), parallel.radiance.height(), 3);
  for (std::size_t i = 0; i < map.samples().size(); ++i)
    map.samples()[i] = static_cast<float>(
        (parallel.radiance.samples()[i] / shown->scale - cross.radiance.samples()[i]) / white);
  return map;
}

}  // namespace opaline::daemon
