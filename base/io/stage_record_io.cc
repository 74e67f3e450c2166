#include "base/io/stage_record_io.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/format_version.h"

namespace opaline {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kFile = "light_stage.json";

ordered_json to_json(Vec3 v) { return {v.x, v.y, v.z}; }

Vec3 vector_from(const json& j) {
  return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()};
}

ordered_json to_json(const StageRecord& record) {
  auto lights = ordered_json::array();
  for (const SphereLight& light : record.lights)
    lights.push_back(
        {{"position_mm", to_json(light.position)}, {"intensity_w_per_sr", light.intensity}});
  auto pictures = ordered_json::array();
  for (const StagePicture& picture : record.pictures)
    pictures.push_back({{"name", picture.name},
                        {"parallel", picture.parallel},
                        {"scale", picture.scale},
                        {"codes", picture.codes}});
  auto axes = ordered_json::array();
  for (const Vec3 axis : record.axes) axes.push_back(to_json(axis));
  return {{"format", kStageRecordFormat},
          {"axes", axes},
          {"middle_mm", to_json(record.middle)},
          {"middle_px", {record.middle_x, record.middle_y}},
          {"pixel_mm", record.pixel_mm},
          {"distance_mm", record.distance_mm},
          {"depolarised", record.depolarised},
          {"drift", record.drift},
          {"split", record.split},
          {"pictures", pictures},
          {"lights", lights}};
}

StageRecord record_from(const json& j) {
  StageRecord record;
  for (const json& light : j.at("lights"))
    record.lights.push_back(
        {vector_from(light.at("position_mm")), light.at("intensity_w_per_sr").get<double>()});
  for (const json& picture : j.at("pictures"))
    record.pictures.push_back({picture.at("name").get<std::string>(),
                               picture.at("codes").get<std::vector<std::uint8_t>>(),
                               picture.at("parallel").get<bool>(),
                               picture.at("scale").get<double>()});
  for (std::size_t n = 0; n < 3; ++n) record.axes[n] = vector_from(j.at("axes").at(n));
  record.middle = vector_from(j.at("middle_mm"));
  record.middle_x = j.at("middle_px").at(0).get<double>();
  record.middle_y = j.at("middle_px").at(1).get<double>();
  record.pixel_mm = j.at("pixel_mm").get<double>();
  record.distance_mm = j.at("distance_mm").get<double>();
  record.depolarised = j.at("depolarised").get<double>();
  record.drift = j.at("drift").get<double>();
  record.split = j.at("split").get<bool>();
  return record;
}

Result<void> check(const StageRecord& record) {
  if (record.lights.empty()) return invalid_argument("no lights");
  if (!(record.distance_mm >= 0.0))
    return invalid_argument(fmt::format("a camera at {} mm", record.distance_mm));
  if (!(record.pixel_mm > 0.0 && std::isfinite(record.pixel_mm)))
    return invalid_argument(fmt::format("pixels of {} mm", record.pixel_mm));
  for (const StagePicture& picture : record.pictures)
    if (picture.codes.size() != record.lights.size() || !(picture.scale > 0.0))
      return invalid_argument(fmt::format("{}: {} codes for {} lights, scale {}",
                                          picture.name,
                                          picture.codes.size(),
                                          record.lights.size(),
                                          picture.scale));
  return ok();
}

}  // namespace

Result<void> write_stage_record(FileOperations& files,
                                const std::filesystem::path& directory,
                                const StageRecord& record) {
  return write_whole(files, directory / kFile, to_json(record).dump(1) + "\n");
}

Result<StageRecord> read_stage_record(const std::filesystem::path& directory) {
  const std::filesystem::path path = directory / kFile;
  const auto text = read_text(path);
  if (!text) return text.error();
  const json parsed = json::parse(*text, nullptr, false);
  const auto damaged = [&](std::string_view why) {
    return invalid_argument(fmt::format("{}: damaged: {}", path.string(), why));
  };
  if (parsed.is_discarded() || !parsed.is_object()) return damaged("no JSON object");
  const auto format = format_of(parsed);
  if (!format) return damaged("no format");
  if (*format > kStageRecordFormat) return newer_format(path, *format, kStageRecordFormat);
  try {
    StageRecord record = record_from(parsed);
    if (auto good = check(record); !good) return damaged(good.error().message);
    return record;
  } catch (const json::exception& failure) {
    return damaged(failure.what());
  }
}

}  // namespace opaline
