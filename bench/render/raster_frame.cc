#include "bench/render/raster_frame.h"

#include <cmath>
#include <cstdlib>
#include <vector>

#include "base/log.h"
#include "bench/figure.h"
#include "bench/stopwatch.h"
#include "render/raster/raster_renderer.h"

namespace opaline::bench {
namespace {

constexpr int kRasterFrames = 20;

render::Scene hundred_thousand_triangles() {
  render::Scene scene;
  scene.picture.width = scene.picture.height = 1024;
  scene.picture.refinement = 2;
  scene.camera.position = {34.0, -40.0, 32.0};
  scene.diffusion.tetrahedra = 3e4;
  render::ObjectOptions ring;
  ring.name = "ring";
  ring.shape.name = "torus";
  ring.shape.size_mm = 30.0;
  scene.objects = {ring};
  scene.lights = {{.name = "sun", .direction = {-0.5, -1.0, -0.9}}};
  return scene;
}

template <class T>
T expect(Result<T> result) {
  if (result) return *std::move(result);
  log::error("{}", result.error().message);
  std::exit(1);
}

}  // namespace

RasterFrame raster_frame() {
  ThreadTeam team(2);
  render::Scene scene = hundred_thousand_triangles();
  const auto lit =
      expect(render::SceneRenderer::create(scene, team, [](std::string_view, double) {}, {}));
  const auto raster = expect(render::RasterRenderer::create({}));
  std::vector<double> whole;
  std::vector<double> taking;
  std::vector<double> drawing;
  std::vector<double> cpu;
  for (int f = 0; f <= kRasterFrames; ++f) {
    scene.lights[0].direction = {std::cos(0.05 * f), std::sin(0.05 * f), -0.9};
    scene.camera.position = {40.0 * std::cos(0.03 * f), 40.0 * std::sin(0.03 * f), 32.0};
    if (auto solved = lit->light(scene.lights, {}); !solved) expect(Result<int>(solved.error()));
    const Stopwatch watch;
    if (auto taken = raster->take(*lit); !taken) expect(Result<int>(taken.error()));
    const double taken = watch.seconds();
    static_cast<void>(expect(raster->draw(camera_of(scene.camera, scene.picture), 1, {})));
    const double seconds = watch.seconds();
    const double busy = watch.cpu();
    if (f == 0) continue;  // the first pays for compilation
    whole.push_back(1e3 * seconds);
    cpu.push_back(1e3 * busy);
    taking.push_back(1e3 * taken);
    drawing.push_back(1e3 * (seconds - taken));
  }
  return {median(taking),
          median(drawing),
          median(whole),
          median(cpu),
          lit->statistics().objects[0].triangles};
}

}  // namespace opaline::bench
