#include "bench/paper/samples.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <utility>

#include "base/files.h"
#include "base/io/transport_io.h"
#include "bench/inverse/finite_elements.h"
#include "bench/inverse/transport_dataset.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/prediction.h"
#include "reconstruct/regrid.h"
#include "reconstruct/relighting_error.h"

namespace opaline::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kPatches = 8;  // that E is taken over

fs::path cache_directory() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME")) return fs::path(cache) / "opaline/bench";
  if (const char* home = std::getenv("HOME")) return fs::path(home) / ".cache/opaline/bench";
  return fs::temp_directory_path() / "opaline-bench";
}

}  // namespace

Result<PaperSample> make_sample(std::string name, const sim::SceneOptions& scene) {
  auto truth = sim::make_material(scene);
  if (!truth) return truth.error();
  return PaperSample{std::move(name), scene, *std::move(truth)};
}

Result<TransportResponses> elements_of(const PaperSample& sample, int patches) {
  const std::string scene = sim::to_json(sample.scene);
  const fs::path file =
      cache_directory() / fmt::format("elements-paper-{}-{}.transport", sample.name, patches);
  if (auto stored = read_transport(file); stored && stored->scene == scene) return stored;
  fmt::print(stderr, "{}: finite elements under {}^2 patches\n", sample.name, patches);
  TransportResponses responses = finite_element_responses(sample.truth, patches, {2, 2, 2});
  responses.scene = scene;
  std::error_code ignored;
  fs::create_directories(file.parent_path(), ignored);
  if (auto kept = write_transport(system_files(), file, responses); !kept)
    fmt::print(stderr, "not kept: {}\n", kept.error().message);
  return responses;
}

Result<Dataset> measurements(const PaperSample& sample, int n, double noise) {
  const int patches = kPatches % n == 0 ? kPatches : n;
  const auto responses = elements_of(sample, patches);
  if (!responses) return responses.error();
  // Noise comes after the regions are put together: it is that of n x n pictures.
  Dataset dataset = dataset_from_transport(*responses, {.regions = n, .noise = noise});
  std::erase_if(dataset.illuminations, [](const Illumination& i) { return i.held_out; });
  return dataset;
}

Result<double> bssrdf_error(const PaperSample& sample,
                            const Material& material,
                            reconstruct::diffusion::FluenceSolver& solver) {
  const auto responses = elements_of(sample, kPatches);
  if (!responses) return responses.error();
  const Dataset patches = patch_dataset(*responses);
  const auto predicted = reconstruct::predict(patches, material, {}, solver, {});
  if (!predicted) return predicted.error();
  const double error = reconstruct::relighting_error(patches, *predicted, true).error;
  return error * error;
}

}  // namespace opaline::bench
