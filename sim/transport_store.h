#pragma once

#include <filesystem>
#include <stop_token>

#include "base/events.h"
#include "base/result.h"
#include "base/transport_responses.h"
#include "sim/light_transport.h"
#include "sim/scene.h"

namespace opaline::sim {

/// Where responses may lie already.
struct StoreOptions {
  std::filesystem::path committed;  ///< a file to look at first; empty or not there: none
  std::filesystem::path
      cache;  ///< directory; empty: $XDG_CACHE_HOME/opaline/transport or ~/.cache/opaline/transport
};

/// SHA-256 over everything the responses depend on: scene, options (threads apart) and the
/// algorithm's version.
std::string transport_key(const SceneOptions& scene, const ResponseOptions& options);

/// The file that belongs to a key, in the cache.
std::filesystem::path cache_file(const StoreOptions& store, const std::string& key);

/// The responses for a scene: from the committed file when its scene, geometry and camera are those
/// asked for, it was made by this program's method (transport_generator()) and it has at least as
/// many photons; else from the cache; else computed, with progress, and put there whole. Two processes that want the same do not compute it twice: the
/// second waits for the first and reads its file.
///
/// A damaged cached file is computed again; a damaged committed one is an error. A cache that cannot be written, or
/// locked, is a warning and not an error: what took an hour to compute is returned all the same.
/// Errors: kInvalidArgument, kCancelled, kUnavailable (the committed file).
Result<TransportResponses> load_or_compute(const SceneOptions& scene,
                                           const ResponseOptions& options,
                                           const StoreOptions& store,
                                           EventSink& events,
                                           std::stop_token stop);

}  // namespace opaline::sim
