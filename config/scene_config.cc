#include "config/scene_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/files.h"
#include "config/scene_object_config.h"

namespace opaline::config {
namespace {

using namespace render;  // NOLINT(google-build-using-namespace): a file about its structs

constexpr std::array<std::string_view, 4> kLightKinds{"directional", "point", "spot", "disc"};
constexpr std::array<std::string_view, 2> kEntries{"collimated", "diffuse"};
constexpr std::array<std::string_view, 3> kMethods{"graph", "elements", "polygrid"};
constexpr std::array<std::string_view, 2> kWeights{"two_point", "as_published"};
constexpr std::array<std::string_view, 4> kBoundaries{"two_moment", "jensen", "keijzer", "milne"};

void visit_picture(Fields& fields, PictureOptions& p) {
  fields.whole({"width", "pixels"}, p.width, Range::between(1, 16384));
  fields.whole({"height", "pixels"}, p.height, Range::between(1, 16384));
  fields.whole({"samples", "n: a pixel at an edge takes n x n rays"},
               p.samples_per_axis,
               Range::between(1, 16));
  fields.whole(
      {"refinement", "how often surface triangles are cut into four that follow the shape"},
      p.refinement,
      Range::between(0, 4));
  fields.number(
      {"exposure", "stops: each doubles what PNG shows"}, p.exposure, Range::between(-100, 100));
  fields.number(
      {"white", "radiance shown as white at exposure 0, W/(mm^2 sr); 0: found in the picture"},
      p.white,
      Range::at_least(0));
  fields.numbers({"background", "as PNG shows it, linear"}, p.background, Range::between(0, 1));
  fields.flag({"transparent", "PNG with alpha, without background"}, p.transparent);
}

void visit_camera(Fields& fields, CameraOptions& c) {
  visit_vector(fields, {"position", ""}, c.position, Unit::kLength);
  visit_vector(fields,
               {"target", "what it looks at; a turntable's axis goes through it"},
               c.target,
               Unit::kLength);
  visit_vector(fields, {"up", "towards the picture's top; a turntable's axis"}, c.up, Unit::kPlain);
  fields.quantity({"field_of_view", "of the picture's height"},
                  c.field_of_view_degrees,
                  Unit::kAngle,
                  Range{.min = 0.0, .max = 180.0, .min_excluded = true, .max_excluded = true});
  const Vec3 view = c.target - c.position;
  fields.check(length(view) > 0.0, "target", "expected other than position");
  fields.check(length(cross(view, c.up)) > 1e-6 * length(view) * length(c.up) && length(c.up) > 0.0,
               "up",
               "expected a direction that is not along the view");
}

void visit_environment(Fields& fields, EnvironmentOptions& e) {
  fields.numbers({"radiance", "the same from everywhere, red green blue, W/(mm^2 sr)"},
                 e.radiance,
                 Range::between(0, 1e12));
  fields.whole({"rays", "from each place, to find what hides it; 0: nothing does"},
               e.rays,
               Range::between(0, 4096));
}

void visit_diffusion(Fields& fields, DiffusionOptions& d) {
  fields.one_of({"method", "the papers' graph by volumes; finite elements; the papers' lattice"},
                d.method,
                kMethods);
  fields.one_of({"entry", "how lamps' light goes on behind the surface"}, d.entry, kEntries);
  fields.check(d.method != Discretisation::kPolygrid || d.entry == Entry::kDiffuse,
               "entry",
               "beams are followed through tetrahedra: method = \"polygrid\" needs \"diffuse\"");
  fields.flag(
      {"single_scattering",
       "whether light of lamps that was scattered once is seen along the camera's rays, sharp, "
       "and only the rest diffuses"},
      d.single_scattering);
  fields.check(!d.single_scattering || d.entry == Entry::kCollimated,
               "single_scattering",
               "it is of beams: it needs entry = \"collimated\"");
  fields.whole(
      {"directions",
       "in which diffuse light is followed behind each face to where it scatters first; 0: it "
       "enters at the surface; -1: 4, and not while it moves"},
      d.directions,
      Range::between(DiffusionOptions::kAutomatic, 1024));
  fields.check(d.method != Discretisation::kPolygrid || d.directions <= 0,
               "directions",
               "light is followed through tetrahedra: method = \"polygrid\" needs 0");
  fields.number({"tetrahedra", "about so many an object, if all were of one size"},
                d.tetrahedra,
                Range::between(100, 2e7));
  fields.quantity({"spacing", "edge of the smallest; 0 mm: as `tetrahedra` says"},
                  d.spacing_mm,
                  Unit::kLength,
                  Range::at_least(0));
  fields.number({"interior_growth", "K: d deep they may be spacing + K d long; 0: all of one size"},
                d.interior_growth,
                Range::between(0, 10));
  fields.number(
      {"tolerance", "relative residual of the solution"}, d.tolerance, Range::between(1e-12, 0.1));
  fields.whole({"max_iterations", ""}, d.max_iterations, Range::between(1, 100000));
  fields.whole({"levels", "of the multiresolution hierarchy, at most; 1: smoothing alone"},
               d.levels,
               Range::between(1, 20));
  fields.whole({"corrections", "at most, of a graph's links that lean on their faces; 0: none"},
               d.corrections,
               Range::between(0, 100));
  fields.one_of({"weights", "of a graph's links; as_published (Wang 2010) is for comparison only"},
                d.weights,
                kWeights);
  fields.check(d.weights == GraphWeights::kTwoPoint || d.method == Discretisation::kGraph,
               "weights",
               "they are those of a graph's links: as_published needs method = \"graph\"");
  fields.one_of({"boundary", "condition at the surface"}, d.boundary, kBoundaries);
}

void visit_spot(Fields& fields, LightOptions& l) {
  fields.quantity({"cone", "between axis and rim"},
                  l.cone_degrees,
                  Unit::kAngle,
                  Range{.min = 0.0, .max = 90.0, .min_excluded = true});
  fields.quantity({"blur", "over which the rim fades, inwards"},
                  l.blur_degrees,
                  Unit::kAngle,
                  Range::between(0, 90));
  fields.check(l.blur_degrees <= l.cone_degrees, "blur", "expected at most the cone");
}

void visit_light(Fields& fields, LightOptions& l) {
  fields.text({"name", "as statistics call it"}, l.name);
  fields.one_of({"kind", ""}, l.kind, kLightKinds);
  const bool far = l.kind == LightOptions::Kind::kDirectional;
  if (!far) visit_vector(fields, {"position", "", true}, l.position, Unit::kLength);
  if (l.kind != LightOptions::Kind::kPoint) {
    visit_vector(fields, {"direction", "in which it shines", true}, l.direction, Unit::kPlain);
    fields.check(length(l.direction) > 0.0, "direction", "expected a vector that is not 0");
  }
  const bool disc = l.kind == LightOptions::Kind::kDisc;
  Colour& strength = far ? l.irradiance : disc ? l.radiance : l.intensity;
  const char* name = far ? "irradiance" : disc ? "radiance" : "intensity";
  const char* unit = far    ? "on a surface across it, W/mm^2"
                     : disc ? "to all sides before it, W/(mm^2 sr)"
                            : "W/sr";
  fields.numbers({name, unit, true}, strength, Range::between(0, 1e12));
  fields.check(std::ranges::max(strength) > 0.0, name, "expected light in some channel");
  if (l.kind == LightOptions::Kind::kSpot) visit_spot(fields, l);
  if (disc) {
    fields.length_mm({"radius", ""}, l.radius_mm, Range{.min = 1e-6, .max = kFarthest});
    fields.whole({"samples", "points that stand for it"}, l.samples, Range::between(1, 256));
  }
  fields.flag({"shadows", "whether objects hide it"}, l.shadows);
}

void visit_scene(Fields& fields, Scene& scene) {
  fields.text({"name", "for people"}, scene.name);
  fields.table({"picture", "What is written."},
               [&](Fields& f) { visit_picture(f, scene.picture); });
  fields.table({"camera", "Where it is seen from; lengths in the scene's frame."},
               [&](Fields& f) { visit_camera(f, scene.camera); });
  fields.table({"environment", "Light from everywhere."},
               [&](Fields& f) { visit_environment(f, scene.environment); });
  fields.table({"diffusion", "How the light in translucent objects is solved for."},
               [&](Fields& f) { visit_diffusion(f, scene.diffusion); });
  fields.list({"lights", "Any number of them."}, scene.lights, visit_light);
  fields.list({"objects", "One or more; translucent and opaque ones shadow each other.", true},
              scene.objects,
              visit_object);
  fields.check(!scene.lights.empty() || std::ranges::max(scene.environment.radiance) > 0.0,
               "lights",
               "nothing shines: expected [[lights]], or environment.radiance above 0");
}

Scene example() {
  Scene scene;
  scene.environment.radiance = {0.05, 0.05, 0.06};
  scene.lights = {{.name = "key"},
                  {.name = "lamp", .kind = LightOptions::Kind::kPoint},
                  {.name = "beam", .kind = LightOptions::Kind::kSpot},
                  {.name = "panel", .kind = LightOptions::Kind::kDisc}};
  scene.lights[1].position = scene.lights[2].position = {20.0, -30.0, 40.0};
  scene.lights[3].position = {0.0, 0.0, 40.0};
  scene.lights[2].direction = {-2.0, 3.0, -4.0};
  ObjectOptions body;
  body.name = "body";
  body.shape.name = "torus";
  body.shape.size_mm = 20.0;
  body.material.pattern.kind = PatternOptions::Kind::kVeins;
  body.material.pattern.absorption = {0.05, 0.06, 0.08};
  body.edits = {{.operation = EditOptions::Operation::kScale,
                 .value = {1.0, 4.0, 8.0},
                 .reach = EditOptions::Reach::kDepth,
                 .centre = {7.5, 0.0, 0.0}}};
  body.deform.kind = DeformOptions::Kind::kCage;
  body.deform.handles = {{.point = {-1, -1, 2}, .move = {0.0, 3.0, 0.0}}};
  ObjectOptions floor;
  floor.name = "floor";
  floor.kind = ObjectOptions::Kind::kOpaque;
  floor.shape.name = "plane";
  floor.shape.size_mm = 100.0;
  floor.shape.position.z = -2.5;
  floor.deform.kind = DeformOptions::Kind::kBones;
  floor.deform.bones = {{.head = {-50.0, 0.0, 0.0}, .tail = {0.0, 0.0, 0.0}},
                        {.name = "end",
                         .parent = "bone",
                         .head = {0.0, 0.0, 0.0},
                         .tail = {50.0, 0.0, 0.0},
                         .rotation_degrees = {0.0, -20.0, 0.0}}};
  scene.objects = {body, floor};
  return scene;
}

}  // namespace

Result<Scene> parse_scene(const Source& source) {
  Scene scene;
  const auto problems = read_toml(source, [&](Fields& fields) { visit_scene(fields, scene); });
  if (!problems.empty()) return invalid_argument(to_string(problems));
  if (auto valid = validate(scene); !valid) return valid.error().in(source.file);
  return scene;
}

Result<Scene> load_scene(const std::filesystem::path& file) {
  const auto text = read_text(file);
  if (!text) return text.error();
  return parse_scene({file.string(), *text, std::filesystem::absolute(file).parent_path()});
}

std::string scene_example() {
  Scene scene = example();
  return "# Every key of a scene, with its default or an example. docs/rendering.md explains "
         "them.\n"
         "#   opaline render config/scene.example.toml --output picture.png\n\n" +
         write_toml([&](Fields& fields) { visit_scene(fields, scene); }, /*help=*/true);
}

}  // namespace opaline::config
