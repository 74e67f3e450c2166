#include "config/scene_object_config.h"

#include <algorithm>
#include <array>

namespace opaline::config {
namespace {

using namespace render;  // NOLINT(google-build-using-namespace): a file about its structs

constexpr std::array<std::string_view, 2> kObjectKinds{"translucent", "opaque"};
constexpr std::array<std::string_view, 3> kPatternKinds{"none", "veins", "layers"};
constexpr std::array<std::string_view, 2> kPlacements{"solid", "shell"};
constexpr std::array<std::string_view, 3> kTilings{"clamp", "repeat", "mirror"};
constexpr std::array<std::string_view, 3> kSpeculars{"none", "cook_torrance", "ward"};
constexpr std::array<std::string_view, 4> kOperations{"paint", "scale", "add", "set"};
constexpr std::array<std::string_view, 2> kQuantities{"absorption", "reduced_scattering"};
constexpr std::array<std::string_view, 3> kReaches{"ball", "depth", "through"};
constexpr std::array<std::string_view, 3> kDeforms{"none", "cage", "bones"};
constexpr std::array<std::string_view, 2> kInverted{"refuse", "mark"};

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
  visit_vector(fields, {"position", "of the shape's origin"}, s.position, Unit::kLength);
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
  visit_vector(fields, {"centre", "in the object's frame, at rest"}, e.centre, Unit::kLength);
  visit_vector(fields,
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
  visit_vector(fields, {"move", "", true}, h.move, Unit::kLength);
}

void visit_bone(Fields& fields, Bone& b) {
  fields.text({"name", ""}, b.name);
  fields.text({"parent", "the bone before it that carries it"}, b.parent);
  visit_vector(fields, {"head", "", true}, b.head, Unit::kLength);
  visit_vector(fields, {"tail", "", true}, b.tail, Unit::kLength);
  fields.numbers({"rotation", "about the head: about x, then y, then z"},
                 b.rotation_degrees,
                 Range::between(-720, 720),
                 Unit::kAngle);
  visit_vector(fields, {"move", "after the rotation"}, b.move, Unit::kLength);
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
    fields.one_of({"placement", "the shape is cut from its block; or wrapped in it, z_max outside"},
                  m.placement,
                  kPlacements);
    if (m.placement == Placement::kShell) {
      fields.quantity({"shell_depth", "below the surface; 0 mm: as thick as the block is"},
                      m.shell_depth_mm,
                      Unit::kLength,
                      Range::between(0, kFarthest));
    }
    visit_vector(fields,
                 {"origin", "where its block begins, in the shape's frame"},
                 m.origin,
                 Unit::kLength);
    fields.number({"scale", "of its lengths; coefficients stay per mm"},
                  m.scale,
                  Range{.min = 1e-6, .max = 1e6});
    fields.one_of({"tiling", "beyond the block"}, m.tiling, kTilings);
    fields.path({"surface_reflectance", "what its session measured, an .exr; empty: none"},
                m.surface_reflectance);
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

}  // namespace

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

void visit_vector(Fields& fields, const Key& key, Vec3& value, Unit unit) {
  std::array<double, 3> list{value.x, value.y, value.z};
  fields.numbers(key, list, Range::between(-kFarthest, kFarthest), unit);
  value = {list[0], list[1], list[2]};
}

}  // namespace opaline::config
