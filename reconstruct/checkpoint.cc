#include "reconstruct/checkpoint.h"

#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>

#include "base/log.h"
#include "base/sha256.h"

namespace opaline::reconstruct {
namespace {

using nlohmann::json;

constexpr int kFormat = 6;
constexpr std::size_t kLargestFile = std::size_t{4} << 30;
static_assert(std::endian::native == std::endian::little, "numbers are stored little-endian");

json pack(const std::vector<double>& values) {
  std::vector<std::uint8_t> bytes(values.size() * sizeof(double));
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return json::binary(std::move(bytes));
}

std::vector<double> unpack(const json& j) {
  const auto& bytes = j.get_binary();
  std::vector<double> values(bytes.size() / sizeof(double));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(double));
  return values;
}

json to_json(const std::optional<Interval>& i) { return i ? json{i->lowest, i->highest} : json(); }

std::optional<Interval> interval_from(const json& j) {
  if (j.is_null()) return std::nullopt;
  return Interval{j.at(0).get<double>(), j.at(1).get<double>()};
}

json to_json(const HomogeneousFit& h) {
  json rivals = json::array();
  for (const StartCoefficients& r : h.rivals)
    rivals.push_back({r.reduced_scattering, r.absorption});
  return {h.reduced_scattering,
          h.absorption,
          h.chi_squared,
          h.iterations,
          to_json(h.reduced_scattering_interval),
          to_json(h.absorption_interval),
          rivals};
}

HomogeneousFit homogeneous_from(const json& j) {
  HomogeneousFit fit{.reduced_scattering = j.at(0).get<double>(),
                     .absorption = j.at(1).get<double>(),
                     .chi_squared = j.at(2).get<double>(),
                     .iterations = j.at(3).get<int>(),
                     .solves = 0,
                     .reduced_scattering_interval = interval_from(j.at(4)),
                     .absorption_interval = interval_from(j.at(5))};
  for (const json& r : j.at(6))
    fit.rivals.push_back({r.at(0).get<double>(), r.at(1).get<double>()});
  return fit;
}

json to_json(const ModelReport& r) {
  return {r.name,
          r.parameters,
          r.fitted,
          r.held_out,
          r.standard_error,
          r.gain,
          r.gain_error,
          r.solves,
          r.seconds,
          r.taken,
          r.why};
}

ModelReport rung_from(const json& j) {
  return {.name = j.at(0).get<std::string>(),
          .parameters = j.at(1).get<std::size_t>(),
          .fitted = j.at(2).get<double>(),
          .held_out = j.at(3).get<double>(),
          .standard_error = j.at(4).get<double>(),
          .gain = j.at(5).get<double>(),
          .gain_error = j.at(6).get<double>(),
          .solves = j.at(7).get<long>(),
          .seconds = j.at(8).get<double>(),
          .taken = j.at(9).get<bool>(),
          .why = j.at(10).get<std::string>()};
}

json to_json(const IterationRecord& i) {
  return {i.iteration, i.objective, i.chi_squared_per_datum, i.regularization, i.solves};
}

IterationRecord iteration_from(const json& j) {
  return {j.at(0).get<int>(),
          j.at(1).get<double>(),
          j.at(2).get<double>(),
          j.at(3).get<double>(),
          j.at(4).get<long>()};
}

json to_json(const ChannelReport& r) {
  json history = json::array();
  for (const IterationRecord& i : r.history) history.push_back(to_json(i));
  json ladder = json::array();
  for (const ModelReport& rung : r.ladder) ladder.push_back(to_json(rung));
  return {{"homogeneous", to_json(r.homogeneous)},
          {"history", std::move(history)},
          {"stop_reason", static_cast<int>(r.stop_reason)},
          {"data_count", r.data_count},
          {"noise_per_datum", r.noise_per_datum},
          {"target_per_datum", r.target_per_datum},
          {"solves", r.solves},
          {"seconds", r.seconds},
          {"ladder", std::move(ladder)},
          {"held_out_noise", r.held_out_noise},
          {"cross_validated", r.cross_validated},
          {"grid_correction", r.grid_correction},
          {"model", r.model},
          {"model_reason", r.model_reason}};
}

ChannelReport report_from(const json& j) {
  ChannelReport r;
  r.homogeneous = homogeneous_from(j.at("homogeneous"));
  for (const json& i : j.at("history")) r.history.push_back(iteration_from(i));
  r.stop_reason = static_cast<StopReason>(j.at("stop_reason").get<int>());
  r.data_count = j.at("data_count").get<std::size_t>();
  r.noise_per_datum = j.at("noise_per_datum").get<double>();
  r.target_per_datum = j.at("target_per_datum").get<double>();
  r.solves = j.at("solves").get<long>();
  r.seconds = j.at("seconds").get<double>();
  for (const json& rung : j.at("ladder")) r.ladder.push_back(rung_from(rung));
  r.held_out_noise = j.at("held_out_noise").get<double>();
  r.cross_validated = j.at("cross_validated").get<bool>();
  r.grid_correction = j.at("grid_correction").get<double>();
  r.model = j.at("model").get<std::string>();
  r.model_reason = j.at("model_reason").get<std::string>();
  return r;
}

json to_json(const LbfgsState& s) {
  json pairs = json::array();
  for (const CurvaturePair& p : s.pairs) pairs.push_back({pack(p.s), pack(p.y)});
  return {{"x", pack(s.x)},
          {"value", s.at.value},
          {"chi_squared", s.at.chi_squared},
          {"regularization", s.at.regularization},
          {"gradient", pack(s.at.gradient)},
          {"pairs", std::move(pairs)}};
}

LbfgsState state_from(const json& j) {
  LbfgsState s;
  s.x = unpack(j.at("x"));
  s.at = {j.at("value").get<double>(),
          j.at("chi_squared").get<double>(),
          j.at("regularization").get<double>(),
          unpack(j.at("gradient"))};
  for (const json& p : j.at("pairs")) s.pairs.push_back({unpack(p.at(0)), unpack(p.at(1))});
  return s;
}

json to_json(const ChannelProgress& p) {
  return {{"state", to_json(p.state)}, {"report", to_json(p.report)}};
}

ChannelProgress progress_from(const json& j) {
  return {state_from(j.at("state")), report_from(j.at("report"))};
}

json to_json(const LadderProgress& p) {
  return {{"report", to_json(p.report)},
          {"best", pack(p.best)},
          {"finishing", p.finishing},
          {"correcting", p.correcting},
          {"current", p.current ? to_json(*p.current) : json()}};
}

LadderProgress ladder_from(const json& j) {
  LadderProgress p{report_from(j.at("report")),
                   unpack(j.at("best")),
                   j.at("finishing").get<bool>(),
                   j.at("correcting").get<bool>(),
                   std::nullopt};
  if (!j.at("current").is_null()) p.current = progress_from(j.at("current"));
  return p;
}

json to_json(const SharedProgress& p) {
  json channels = json::array();
  for (const ChannelReport& report : p.channels) channels.push_back(to_json(report));
  return {{"state", to_json(p.state)}, {"channels", std::move(channels)}};
}

SharedProgress shared_from(const json& j) {
  SharedProgress p{state_from(j.at("state")), {}};
  for (std::size_t c = 0; c < kColorChannels; ++c)
    p.channels.at(c) = report_from(j.at("channels").at(c));
  return p;
}

json to_json(const Checkpoint& checkpoint) {
  json finished = json::array();
  for (const auto& channel : checkpoint.finished) {
    if (!channel) break;
    finished.push_back({{"absorption", pack(channel->coefficients.absorption)},
                        {"reduced_scattering", pack(channel->coefficients.reduced_scattering)},
                        {"report", to_json(channel->report)}});
  }
  json j{{"finished", std::move(finished)}};
  if (checkpoint.current) j["current"] = to_json(*checkpoint.current);
  if (checkpoint.shared) j["shared"] = to_json(*checkpoint.shared);
  return j;
}

Checkpoint checkpoint_from(const json& j) {
  Checkpoint checkpoint;
  std::size_t channel = 0;
  for (const json& f : j.at("finished")) {
    checkpoint.finished.at(channel++) = {
        {unpack(f.at("absorption")), unpack(f.at("reduced_scattering"))},
        report_from(f.at("report"))};
  }
  if (j.contains("current")) checkpoint.current = ladder_from(j.at("current"));
  if (j.contains("shared")) checkpoint.shared = shared_from(j.at("shared"));
  return checkpoint;
}

void append(std::vector<std::byte>& bytes, const void* data, std::size_t size) {
  const auto* begin = static_cast<const std::byte*>(data);
  bytes.insert(bytes.end(), begin, begin + size);
}

template <class T>
void append_image(std::vector<std::byte>& bytes, const Image<T>& image) {
  const std::array shape{image.width(), image.height(), image.channels()};
  append(bytes, shape.data(), sizeof shape);
  append(bytes, image.samples().data(), image.samples().size_bytes());
}

void append_options(std::vector<std::byte>& bytes, const InverseOptions& o) {
  const std::array numbers{o.model_error,
                           o.direct_light_paths,
                           o.regularization,
                           static_cast<double>(o.max_iterations),
                           o.tolerance,
                           o.discrepancy,
                           o.stalled,
                           o.absorption.lowest,
                           o.absorption.highest,
                           o.reduced_scattering.lowest,
                           o.reduced_scattering.highest,
                           static_cast<double>(o.checkpoint_every),
                           static_cast<double>(o.source),
                           static_cast<double>(o.deposit),
                           static_cast<double>(o.boundary),
                           static_cast<double>(o.camera),
                           static_cast<double>(o.method),
                           static_cast<double>(o.model),
                           static_cast<double>(o.structure),
                           static_cast<double>(o.regularizer),
                           static_cast<double>(o.coarser_grids),
                           static_cast<double>(o.grid_correction),
                           static_cast<double>(kFormat)};
  append(bytes, numbers.data(), sizeof numbers);
}

// Parses what was read; what the library throws ends here.
Result<Checkpoint> parse(std::span<const std::byte> bytes, const std::string& fingerprint) {
  constexpr std::size_t kChecksum = 64;
  if (bytes.size() < kChecksum) return invalid_argument("truncated");
  const std::string_view checksum(reinterpret_cast<const char*>(bytes.data()), kChecksum);
  const auto body = bytes.subspan(kChecksum);
  if (sha256_hex(body) != checksum) return invalid_argument("damaged");
  try {
    const auto* begin = reinterpret_cast<const std::uint8_t*>(body.data());
    const json j = json::from_cbor(begin, begin + body.size());
    if (j.at("format").get<int>() != kFormat) return invalid_argument("of another version");
    if (j.at("fingerprint").get<std::string>() != fingerprint) {
      return invalid_argument("of another dataset or other options");
    }
    return checkpoint_from(j);
  } catch (const std::exception& e) {
    return invalid_argument(e.what());
  }
}

}  // namespace

std::string fingerprint(const Dataset& dataset, const InverseOptions& options) {
  std::vector<std::byte> bytes;
  const auto cells = dataset.block.cells();
  const auto spacing = dataset.block.spacing();
  append(bytes, cells.data(), sizeof cells);
  append(bytes, spacing.data(), sizeof spacing);
  append(bytes, &dataset.ior, sizeof dataset.ior);
  const std::array faces{dataset.lit_face, dataset.seen_face};
  append(bytes, faces.data(), sizeof faces);
  append_image(bytes, dataset.view_cosine);
  append_image(bytes, dataset.view_direction);
  for (const Illumination& i : dataset.illuminations) {
    append(bytes, i.name.data(), i.name.size() + 1);
    append(bytes, &i.held_out, sizeof i.held_out);
    append_image(bytes, i.irradiance);
    append_image(bytes, i.radiance);
    append_image(bytes, i.radiance_variance);
    append_image(bytes, i.mask);
  }
  append_options(bytes, options);
  return sha256_hex(bytes);
}

CheckpointStore::CheckpointStore(FileOperations& files,
                                 std::filesystem::path directory,
                                 std::string print)
    : files_(files), directory_(std::move(directory)), fingerprint_(std::move(print)) {}

Checkpoint CheckpointStore::load() const {
  const auto bytes = read_bytes(path(), kLargestFile);
  if (!bytes) {
    if (bytes.error().code != ErrorCode::kNotFound)
      log::warning("starting again: {}", bytes.error().message);
    return {};
  }
  auto checkpoint = parse(*bytes, fingerprint_);
  if (checkpoint) return *std::move(checkpoint);
  log::warning("starting again: {}: {}", path().string(), checkpoint.error().message);
  return {};
}

Result<void> CheckpointStore::save(const Checkpoint& checkpoint) const {
  json j = to_json(checkpoint);
  j["format"] = kFormat;
  j["fingerprint"] = fingerprint_;
  const std::vector<std::uint8_t> body = json::to_cbor(j);
  const std::string checksum = sha256_hex(std::as_bytes(std::span(body)));
  std::vector<std::byte> bytes;
  bytes.reserve(checksum.size() + body.size());
  append(bytes, checksum.data(), checksum.size());
  append(bytes, body.data(), body.size());
  if (auto made = files_.make_directories(directory_); !made) return made;
  return write_whole(files_, path(), std::span<const std::byte>(bytes));
}

}  // namespace opaline::reconstruct
