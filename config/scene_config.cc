#include "config/scene_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/files.h"

namespace opaline::config {
namespace {

using namespace render;  // NOLINT(google-build-using-namespace): a file about its structs

constexpr std::array<std::string_view, 2> kObjectKinds{"translucent", "opaque"};
constexpr std::array<std::string_view, 4> kLightKinds{"directional", "point", "spot", "disc"};
constexpr std::array<std::string_view, 3> kPatternKinds{"none", "veins", "layers"};
constexpr std::array<std::string_view, 3> kTilings{"clamp", "repeat", "mirror"};
constexpr std::array<std::string_view, 3> kSpeculars{"none", "cook_torrance", "ward"};
constexpr std::array<std::string_view, 2> kEntries{"collimated", "diffuse"};
constexpr std::array<std::string_view, 3> kMethods{"graph", "elements", "polygrid"};
constexpr std::array<std::string_view, 3> kBoundaries{"two_moment", "jensen", "keijzer"};
constexpr std::array<std::string_view, 4> kOperations{"paint", "scale", "add", "set"};
constexpr std::array<std::string_view, 2> kQuantities{"absorption", "reduced_scattering"};
constexpr std::array<std::string_view, 3> kReaches{"ball", "depth", "through"};
constexpr std::array<std::string_view, 3> kDeforms{"none", "cage", "bones"};
constexpr std::array<std::string_view, 2> kInverted{"refuse", "mark"};
constexpr double kFarthest = 1e6;  // mm

void vector(Fields& fields, const Key& key, Vec3& value, Unit unit) {
  std::array<double, 3> list{value.x, value.y, value.z};
  fields.numbers(key, list, Range::between(-kFarthest, kFarthest), unit);
  value = {list[0], list[1], list[2]};
}

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
  vector(fields, {"position", ""}, c.position, Unit::kLength);
  vector(fields,
         {"target", "what it looks at; a turntable's axis goes through it"},
         c.target,
         Unit::kLength);
  vector(fields, {"up", "towards the picture's top; a turntable's axis"}, c.up, Unit::kPlain);
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
  if (!far) vector(fields, {"position", "", true}, l.position, Unit::kLength);
  if (l.kind != LightOptions::Kind::kPoint) {
    vector(fields, {"direction", "in which it shines", true}, l.direction, Unit::kPlain);
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

void visit_shape(Fields& fields, ShapeOptions& s, bool is_opaque) {
  fields.text({"shape", "sphere | torus | genus3 | knot | figurine | sheet | plane (opaque only)"},
              s.name);
  fields.path(
      {"file",
       "in its place: .obj .off .ply .stl, .vdb with a level set, .mesh .msh .vtk with tetrahedra"},
      s.file);
  fields.quantity({"size", "largest extent; 0 mm: as the file has it"},
                  s.size_mm,
                  Unit::kLength,
                  Range::between(0, kFarthest));
  fields.check(s.name.empty() != s.file.empty(), "shape", "expected either shape or file");
  fields.check(
      s.name.empty() || s.size_mm > 0.0, "size", "expected, of a shape by name, such as \"20 mm\"");
  fields.check(
      is_opaque || s.name != "plane", "shape", "a plane encloses nothing: kind = \"opaque\"");
  if (!s.file.empty()) {
    fields.length_mm({"unit", "of the file's coordinates, where size does not say"}, s.unit_mm);
    fields.flag({"centred", "the file's bounding box is moved to the origin first"}, s.centred);
  }
  vector(fields, {"position", "of the shape's origin"}, s.position, Unit::kLength);
  fields.numbers({"rotation", "about x, then y, then z"},
                 s.rotation_degrees,
                 Range::between(-360, 360),
                 Unit::kAngle);
}

void visit_coefficients(Fields& fields, Colour& absorption, Colour& scattering) {
  fields.numbers(
      {"absorption", "sigma_a: red, green, blue, 1/mm", true}, absorption, Range::between(0, 1e6));
  fields.numbers({"reduced_scattering", "sigma_s': red, green, blue, 1/mm", true},
                 scattering,
                 Range::between(1e-6, 1e6));
}

void visit_pattern(Fields& fields, PatternOptions& p) {
  fields.one_of(
      {"kind", "of a second set of coefficients within the first"}, p.kind, kPatternKinds);
  if (p.kind == PatternOptions::Kind::kNone) return;
  fields.length_mm({"size", "of one period"}, p.size_mm, Range::between(1e-6, 1e6));
  visit_coefficients(fields, p.absorption, p.reduced_scattering);
  fields.check(std::ranges::min(p.absorption) > 0.0,
               "absorption",
               "expected more than 0: logarithms are mixed");
}

void visit_edit(Fields& fields, EditOptions& e) {
  fields.one_of({"operation", ""}, e.operation, kOperations);
  fields.one_of({"quantity", ""}, e.quantity, kQuantities);
  fields.numbers({"value", "red, green, blue: 1/mm, or factors of scale", true},
                 e.value,
                 Range::between(-1e6, 1e6));
  fields.number({"strength", ""}, e.strength, Range::between(0, 1));
  fields.one_of({"reach", "within a ball; some depth below the surface; all along an axis"},
                e.reach,
                kReaches);
  vector(fields, {"centre", "in the object's frame, at rest"}, e.centre, Unit::kLength);
  vector(fields,
         {"direction", "of the axis through the centre, and in which a mask is projected"},
         e.direction,
         Unit::kPlain);
  fields.length_mm({"radius", ""}, e.radius_mm);
  fields.number({"softness", "share of the radius over which the brush falls off"},
                e.softness,
                Range::between(0, 1));
  fields.length_mm({"depth", "below the surface"}, e.depth_mm, Range::at_least(0));
  fields.length_mm({"thickness", "of what a depth means"}, e.thickness_mm);
  fields.path({"mask", "picture across the brush: white takes all, black nothing"}, e.mask);
  const auto valid = validate(e);
  fields.check(valid.has_value(), "value", valid ? "" : valid.error().message);
}

void visit_handle(Fields& fields, CageHandle& h) {
  fields.wholes({"point", "along x, y, z, counted from 0; -1: all of them", true},
                h.point,
                Range::between(-1, 7));
  vector(fields, {"move", "", true}, h.move, Unit::kLength);
}

void visit_bone(Fields& fields, Bone& b) {
  fields.text({"name", ""}, b.name);
  fields.text({"parent", "the bone before it that carries it"}, b.parent);
  vector(fields, {"head", "", true}, b.head, Unit::kLength);
  vector(fields, {"tail", "", true}, b.tail, Unit::kLength);
  fields.numbers({"rotation", "about the head: about x, then y, then z"},
                 b.rotation_degrees,
                 Range::between(-720, 720),
                 Unit::kAngle);
  vector(fields, {"move", "after the rotation"}, b.move, Unit::kLength);
}

void visit_deform(Fields& fields, DeformOptions& d) {
  fields.one_of({"kind", ""}, d.kind, kDeforms);
  if (d.kind == DeformOptions::Kind::kNone) return;
  fields.one_of({"inverted", "what becomes of a shape that is turned inside out somewhere"},
                d.inverted,
                kInverted);
  fields.number({"amount", "share of every move and angle"}, d.amount, Range::between(-10, 10));
  if (d.kind == DeformOptions::Kind::kCage) {
    fields.wholes({"points", "of the cage along x, y, z"}, d.points, Range::between(2, 8));
    fields.list({"handles", "Its control points that move.", true}, d.handles, visit_handle);
  } else {
    fields.list({"bones", "Each place goes with the bones near it.", true}, d.bones, visit_bone);
  }
  const auto valid = validate(d);
  fields.check(valid.has_value(), "kind", valid ? "" : valid.error().message);
}

void visit_material(Fields& fields, TranslucentOptions& m) {
  fields.path({"file", "a material.vdb, from a session or painted"}, m.file);
  if (!m.file.empty()) {
    vector(fields,
           {"origin", "where its block begins, in the shape's frame"},
           m.origin,
           Unit::kLength);
    fields.number({"scale", "of its lengths; coefficients stay per mm"},
                  m.scale,
                  Range{.min = 1e-6, .max = 1e6});
    fields.one_of({"tiling", "beyond the block"}, m.tiling, kTilings);
  }
  if (m.file.empty()) {
    visit_coefficients(fields, m.absorption, m.reduced_scattering);
    fields.number(
        {"ior", "relative refractive index; a file brings its own"}, m.ior, Range::between(1, 3));
    fields.whole({"edit_cells", "along the longest side of the block that edits go into"},
                 m.edit_cells,
                 Range::between(1, 1024));
    fields.table({"pattern", "Instead of the same everywhere."},
                 [&](Fields& f) { visit_pattern(f, m.pattern); });
    fields.check(
        m.pattern.kind == PatternOptions::Kind::kNone || std::ranges::min(m.absorption) > 0.0,
        "absorption",
        "expected more than 0 with a pattern: logarithms are mixed");
  }
}

void visit_surface(Fields& fields, SurfaceOptions& s) {
  fields.one_of({"specular", "how the surface mirrors lights"}, s.specular, kSpeculars);
  fields.number(
      {"roughness", "slope of its facets, root mean square"}, s.roughness, Range::between(0.01, 1));
}

void visit_object(Fields& fields, ObjectOptions& o) {
  fields.text({"name", "as statistics call it"}, o.name);
  fields.one_of({"kind", ""}, o.kind, kObjectKinds);
  const bool is_opaque = o.kind == ObjectOptions::Kind::kOpaque;
  visit_shape(fields, o.shape, is_opaque);
  visit_surface(fields, o.surface);
  if (is_opaque) {
    fields.numbers(
        {"reflectance", "Lambert's: red, green, blue"}, o.reflectance, Range::between(0, 1));
    fields.number({"ior", "of a coat that mirrors; 1: matte"}, o.opaque_ior, Range::between(1, 3));
  } else {
    fields.table({"material", "What it is made of."},
                 [&](Fields& f) { visit_material(f, o.material); });
    fields.list({"edits", "Strokes in the material, one after another."}, o.edits, visit_edit);
  }
  fields.table({"deform", "How it is bent, in its own frame."},
               [&](Fields& f) { visit_deform(f, o.deform); });
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
