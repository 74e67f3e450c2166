#include "sim/transport_store.h"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/files.h"
#include "base/io/transport_io.h"
#include "base/lock.h"
#include "base/log.h"
#include "base/sha256.h"

namespace opaline::sim {
namespace {

constexpr int kAlgorithm = 2;  // raise it when the same options give other numbers
constexpr std::chrono::milliseconds kLockPoll{200};

/// What is asked for agrees with what a file holds; the file may have more photons and any seed.
bool serves(const TransportResponses& responses,
            const SceneOptions& scene,
            const ResponseOptions& options) {
  const auto described = scene_from_json(responses.scene);
  return described && *described == scene && responses.generator == transport_generator() &&
         responses.lit_face == options.lit_face && responses.seen_face == options.seen_face &&
         responses.diffuse_entry == options.diffuse_entry &&
         responses.patches_x == options.patches_x && responses.patches_y == options.patches_y &&
         length(responses.camera_centre - options.camera_centre) < 1e-6 &&
         responses.anisotropy == options.anisotropy &&
         responses.photons_per_patch >= options.photons_per_patch;
}

/// From a file, if it is there and serves; nothing if not.
Result<std::optional<TransportResponses>> from_file(const std::filesystem::path& path,
                                                    const SceneOptions& scene,
                                                    const ResponseOptions& options) {
  if (path.empty()) return std::optional<TransportResponses>();
  auto responses = read_transport(path);
  if (!responses && responses.error().code == ErrorCode::kNotFound) {
    return std::optional<TransportResponses>();
  }
  if (!responses) return responses.error();
  if (!serves(*responses, scene, options)) return std::optional<TransportResponses>();
  return std::optional(*std::move(responses));
}

std::filesystem::path default_cache() {
  const auto variable = [](const char* name) -> std::filesystem::path {
    const char* value = std::getenv(name);
    return value != nullptr ? value : "";
  };
  if (const auto cache = variable("XDG_CACHE_HOME"); cache.is_absolute()) {
    return cache / "opaline" / "transport";
  }
  if (const auto home = variable("HOME"); home.is_absolute()) {
    return home / ".cache" / "opaline" / "transport";
  }
  return std::filesystem::temp_directory_path() / "opaline-transport";
}

/// The right to compute a file of the cache; waits while another process computes the same.
Result<FileLock> lock_entry(const std::filesystem::path& path,
                            EventSink& events,
                            const std::stop_token& stop) {
  if (auto made = system_files().make_directories(path.parent_path()); !made) return made.error();
  std::mutex mutex;
  std::condition_variable_any stopped;
  std::unique_lock guard(mutex);
  while (true) {
    auto lock = FileLock::acquire(path.string() + ".lock");
    if (lock || lock.error().code != ErrorCode::kBusy) return lock;
    events.progress({.step = "light transport",
                     .fraction = 0.0,
                     .seconds_left = std::nullopt,
                     .detail = {{"waiting", "another process computes the same"}}});
    stopped.wait_for(guard, stop, kLockPoll, [] { return false; });
    if (stop.stop_requested()) return cancelled("light transport was stopped");
  }
}

/// From the cache; a file that cannot be read counts as not there.
std::optional<TransportResponses> from_cache(const std::filesystem::path& path,
                                             const SceneOptions& scene,
                                             const ResponseOptions& options) {
  auto found = from_file(path, scene, options);
  if (found) return *std::move(found);
  log::warning("{}; computing it again", found.error().message);
  return std::nullopt;
}

}  // namespace

std::string transport_key(const SceneOptions& scene, const ResponseOptions& options) {
  const Vec3 c = options.camera_centre;
  const nlohmann::ordered_json json{{"algorithm", kAlgorithm},
                                    {"scene", to_json(scene)},
                                    {"lit_face", to_string(options.lit_face)},
                                    {"seen_face", to_string(options.seen_face)},
                                    {"diffuse_entry", options.diffuse_entry},
                                    {"patches", {options.patches_x, options.patches_y}},
                                    {"camera_centre_mm", {c.x, c.y, c.z}},
                                    {"anisotropy", options.anisotropy},
                                    {"seed", options.seed},
                                    {"photons", whole_batches(options.photons_per_patch)}};
  const std::string text = json.dump();
  return sha256_hex(std::as_bytes(std::span(text)));
}

std::filesystem::path cache_file(const StoreOptions& store, const std::string& key) {
  return (store.cache.empty() ? default_cache() : store.cache) / (key + ".transport");
}

Result<TransportResponses> load_or_compute(const SceneOptions& scene,
                                           const ResponseOptions& options,
                                           const StoreOptions& store,
                                           EventSink& events,
                                           std::stop_token stop) {
  auto committed = from_file(store.committed, scene, options);
  if (!committed) return committed.error();
  if (committed->has_value()) return **std::move(committed);
  auto material = make_material(scene);
  if (!material) return material.error();

  const std::filesystem::path path = cache_file(store, transport_key(scene, options));
  if (auto cached = from_cache(path, scene, options)) return *std::move(cached);
  auto lock = lock_entry(path, events, stop);
  if (!lock) {
    if (lock.error().code == ErrorCode::kCancelled) return lock.error();
    log::warning("light transport is computed, but may not be kept: {}", lock.error().message);
  }
  if (auto cached = from_cache(path, scene, options)) return *std::move(cached);
  auto responses = compute_responses(*material, options, to_json(scene), events, stop);
  if (!responses) return responses.error();
  if (auto written = write_transport(system_files(), path, *responses); !written) {
    log::warning("light transport is computed, but not kept: {}", written.error().message);
  }
  return responses;
}

}  // namespace opaline::sim
