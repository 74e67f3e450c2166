#include "bench/inverse/material_cases.h"

#include <cstdio>

#include "base/events.h"
#include "sim/transport_store.h"

namespace opaline::bench {
namespace {

struct Ground {
  const char* name;
  sim::SceneKind kind;
  double reduced_scattering;
  double absorption;
  double feature_mm;
};
constexpr Ground kGrounds[] = {{"marble", sim::SceneKind::kMarble, 1.6, 0.004, 6.0},
                               {"wax", sim::SceneKind::kWax, 1.2, 0.003, 6.0},
                               {"stone", sim::SceneKind::kStone, 2.0, 0.02, 5.0}};

MaterialCase make_case(const Ground& ground, bool front) {
  MaterialCase made;
  made.name = std::string(ground.name) + (front ? "-front" : "-back");
  made.scene.kind = ground.kind;
  made.scene.reduced_scattering = ground.reduced_scattering;
  made.scene.absorption = ground.absorption;
  made.scene.feature_mm = ground.feature_mm;
  made.scene.block.nz = front ? 24 : 12;
  made.transport.lit_face = front ? Face::kZMax : Face::kZMin;
  made.transport.camera_centre = sim::camera_above(made.scene.block, 300.0, front ? 20.0 : 10.0);
  made.transport.photons_per_patch = front ? 1u << 21 : 1u << 19;
  return made;
}

class LineOfProgress : public NullSink {
 public:
  void progress(const Progress& p) override {
    std::fprintf(stderr,
                 "\r%s: %3.0f %%, %.0f s left   ",
                 p.step.c_str(),
                 100.0 * p.fraction,
                 p.seconds_left.value_or(0.0));
    if (p.fraction >= 1.0) std::fputc('\n', stderr);
  }
};

}  // namespace

std::vector<std::string> material_case_names() {
  std::vector<std::string> names;
  for (const bool front : {false, true}) {
    for (const Ground& ground : kGrounds) names.push_back(make_case(ground, front).name);
  }
  return names;
}

std::optional<MaterialCase> material_case(const std::string& name) {
  for (const bool front : {false, true}) {
    for (const Ground& ground : kGrounds) {
      if (auto made = make_case(ground, front); made.name == name) return made;
    }
  }
  return std::nullopt;
}

Result<TransportResponses> responses_of(const MaterialCase& material,
                                        const std::filesystem::path& cache) {
  LineOfProgress progress;
  return sim::load_or_compute(
      material.scene, material.transport, {"sim/data/demo_marble.transport", cache}, progress, {});
}

}  // namespace opaline::bench
