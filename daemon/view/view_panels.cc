#include "daemon/view/view_panels.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>

#include "base/files.h"
#include "daemon/jobs/version.h"

namespace opaline::daemon {
namespace {

using render::EditOptions;
using render::ViewModel;

constexpr std::array kOperationNames{"paint", "scale", "add", "set"};
constexpr std::array kQuantityNames{"absorption", "reduced_scattering"};
constexpr std::array kReachNames{"ball", "depth", "through"};
constexpr double kDegreesPerPixel = 0.35;
constexpr float kPixelsBetweenDabs = 4.0F;

template <class Enum, std::size_t N>
bool combo(const char* label, Enum& value, const std::array<const char*, N>& names) {
  int index = static_cast<int>(value);
  const bool changed = ImGui::Combo(label, &index, names.data(), static_cast<int>(N));
  value = static_cast<Enum>(index);
  return changed;
}

bool slider(const char* label, double& value, double low, double high, bool logarithmic = false) {
  return ImGui::SliderScalar(label,
                             ImGuiDataType_Double,
                             &value,
                             &low,
                             &high,
                             "%.4g",
                             logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
}

template <class T>
void say(ViewDesk& desk, const Result<T>& result, const std::string& done) {
  desk.message = result ? done : result.error().message;
}

void brush_panel(ViewModel& model, ViewDesk& desk) {
  EditOptions& brush = desk.brush;
  ImGui::Checkbox("paint with the left button", &desk.painting);
  combo("operation", brush.operation, kOperationNames);
  combo("quantity", brush.quantity, kQuantityNames);
  constexpr std::array kColours{"red", "green", "blue"};
  for (int c = 0; c < 3; ++c) slider(kColours[c], brush.value[c], 1e-4, 100.0, true);
  slider("strength", brush.strength, 0.0, 1.0);
  combo("reach", brush.reach, kReachNames);
  slider("radius, mm", brush.radius_mm, 0.1, 50.0, true);
  slider("softness", brush.softness, 0.0, 1.0);
  if (brush.reach == EditOptions::Reach::kDepth) {
    slider("depth, mm", brush.depth_mm, 0.0, 20.0);
    slider("thickness, mm", brush.thickness_mm, 0.1, 20.0, true);
  }
  for (std::size_t o = 0; o < model.scene().objects.size(); ++o) {
    const auto& object = model.scene().objects[o];
    if (object.kind != render::ObjectOptions::Kind::kTranslucent) continue;
    if (ImGui::Button(fmt::format("all of {}", object.name).c_str())) {
      const auto cells = model.paint_all(o, brush);
      say(desk, cells, fmt::format("{} cells", cells ? *cells : 0));
    }
  }
  if (ImGui::Button("undo") && model.can_undo()) say(desk, model.undo(), "taken back");
  ImGui::SameLine();
  if (ImGui::Button("redo") && model.can_redo()) say(desk, model.redo(), "done again");
}

void save_panel(ViewModel& model, ViewDesk& desk) {
  std::array<char, 512> text{};
  desk.save_as.copy(text.data(), text.size() - 1);
  if (ImGui::InputText("file", text.data(), text.size())) desk.save_as = text.data();
  for (const auto& object : model.scene().objects) {
    if (object.kind != render::ObjectOptions::Kind::kTranslucent) continue;
    if (ImGui::Button(fmt::format("save {}", object.name).c_str())) {
      const auto saved = save_object(model, object.name, desk.save_as);
      say(desk, saved, saved ? *saved : "");
    }
  }
}

void light_panel(ViewModel& model, ViewDesk& desk) {
  for (std::size_t l = 0; l < model.lights().size(); ++l) {
    ImGui::PushID(static_cast<int>(l));
    ImGui::RadioButton(model.lights()[l].name.c_str(), &desk.light, static_cast<int>(l));
    ImGui::SameLine();
    if (ImGui::SmallButton("-")) model.scale_light(l, 0.8);
    ImGui::SameLine();
    if (ImGui::SmallButton("+")) model.scale_light(l, 1.25);
    ImGui::PopID();
  }
  ImGui::TextUnformatted("Shift and the left button turn it");
}

void bend_panel(ViewModel& model, ViewDesk& desk) {
  for (std::size_t o = 0; o < model.scene().objects.size(); ++o) {
    const auto& object = model.scene().objects[o];
    if (object.deform.kind == render::DeformOptions::Kind::kNone) continue;
    double amount = object.deform.amount;
    if (!slider(fmt::format("bend {}", object.name).c_str(), amount, -1.0, 2.0)) continue;
    const auto inverted = model.bend(o, amount);
    say(desk,
        inverted,
        inverted && *inverted > 0
            ? fmt::format("{} tetrahedra are turned inside out: the light stays as it was",
                          *inverted)
            : "");
  }
}

void quality_panel(ViewModel& model, ViewDesk& desk) {
  double tolerance = model.scene().diffusion.tolerance;
  if (slider("residual", tolerance, 1e-5, 0.1, true)) model.set_tolerance(tolerance);
  slider("resolution", desk.resolution, 0.1, 1.0);
  slider("exposure, stops", desk.exposure, -8.0, 8.0);
  if (ImGui::Button("camera as it was")) model.look_from_start();
}

void statistics_panel(ViewModel& model, const ViewDesk& desk) {
  const render::SceneStatistics& s = model.statistics();
  ImGui::TextWrapped("%s", model.device().c_str());
  ImGui::Text("frame %.0f ms; light %.0f, solve %.0f",
              1e3 * desk.frame_seconds,
              1e3 * s.light_seconds,
              1e3 * s.solve_seconds);
  for (const auto& object : s.objects) {
    if (!object.translucent) {
      ImGui::TextWrapped("%s: %zu triangles", object.name.c_str(), object.triangles);
      continue;
    }
    ImGui::TextWrapped("%s: %zu tetrahedra, %d iterations to %.1e, %zu triangles",
                       object.name.c_str(),
                       object.body.tetrahedra,
                       object.iterations,
                       object.relative_residual,
                       object.triangles);
  }
  if (model.is_lighting()) ImGui::TextUnformatted("finding the light ...");
  for (const auto& what : s.left_out) ImGui::TextWrapped("off: %s", what.c_str());
  for (const auto& what : model.left_out()) ImGui::TextWrapped("off: %s", what.c_str());
  for (const auto& note : s.notes) ImGui::TextWrapped("%s", note.c_str());
  if (model.device_losses() > 0) ImGui::Text("the device was lost %d times", model.device_losses());
}

template <class Enum, std::size_t N>
Result<void> choose(Enum& value, const std::string& name, const std::array<const char*, N>& names) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return invalid_argument(fmt::format("brush: no \"{}\"", name));
  value = static_cast<Enum>(found - names.begin());
  return ok();
}

bool as_number(const std::string& text, double& value) {
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  return problem == std::errc() && end == text.data() + text.size();
}

Result<void> set_value(EditOptions& brush, const std::string& text) {
  std::istringstream stream(text);
  std::string word;
  for (double& value : brush.value) {
    if (!std::getline(stream, word, ',') || !as_number(word, value)) {
      return invalid_argument(fmt::format("brush value \"{}\": expected R,G,B", text));
    }
  }
  return ok();
}

}  // namespace

void draw_panels(ViewModel& model, ViewDesk& desk) {
  ImGui::SetNextWindowPos({8.0F, 8.0F}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize({330.0F, 620.0F}, ImGuiCond_FirstUseEver);
  ImGui::Begin("Opaline");
  ImGui::PushItemWidth(150.0F);
  if (ImGui::CollapsingHeader("Brush", ImGuiTreeNodeFlags_DefaultOpen)) brush_panel(model, desk);
  if (ImGui::CollapsingHeader("Save")) save_panel(model, desk);
  if (ImGui::CollapsingHeader("Lights", ImGuiTreeNodeFlags_DefaultOpen)) light_panel(model, desk);
  bend_panel(model, desk);
  if (ImGui::CollapsingHeader("Speed and accuracy", ImGuiTreeNodeFlags_DefaultOpen)) {
    quality_panel(model, desk);
  }
  if (ImGui::CollapsingHeader("Statistics", ImGuiTreeNodeFlags_DefaultOpen)) {
    statistics_panel(model, desk);
  }
  if (!desk.message.empty()) ImGui::TextWrapped("%s", desk.message.c_str());
  ImGui::PopItemWidth();
  ImGui::End();
}

void follow_mouse(ViewModel& model, ViewDesk& desk, int width, int height) {
  const ImGuiIO& io = ImGui::GetIO();
  if (io.WantCaptureMouse) return;
  if (io.MouseWheel != 0.0F) model.zoom(std::pow(0.9, io.MouseWheel));
  const double right = kDegreesPerPixel * io.MouseDelta.x;
  const double up = -kDegreesPerPixel * io.MouseDelta.y;
  const bool still = right == 0.0 && up == 0.0;
  if (ImGui::IsMouseDown(ImGuiMouseButton_Right) && !still) {
    model.pan(io.MouseDelta.x / static_cast<double>(height),
              -io.MouseDelta.y / static_cast<double>(height));
  }
  if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) return;
  if (io.KeyShift) {
    if (!still) model.turn_light(static_cast<std::size_t>(desk.light), right, up);
  } else if (!desk.painting) {
    if (!still) model.orbit(right, -up);
  } else if (const bool begins = ImGui::IsMouseClicked(ImGuiMouseButton_Left);
             begins || std::hypot(io.MouseDelta.x, io.MouseDelta.y) >= kPixelsBetweenDabs) {
    const auto cells =
        model.paint(io.MousePos.x, io.MousePos.y, width, height, desk.brush, !begins);
    say(desk, cells, fmt::format("{} cells", cells ? *cells : 0));
  }
}

Result<void> set_brush(EditOptions& brush, const std::string& name, const std::string& value) {
  if (name == "operation") return choose(brush.operation, value, kOperationNames);
  if (name == "quantity") return choose(brush.quantity, value, kQuantityNames);
  if (name == "reach") return choose(brush.reach, value, kReachNames);
  if (name == "value") return set_value(brush, value);
  if (name == "mask") {
    brush.mask = value;
    return ok();
  }
  const std::array<std::pair<const char*, double*>, 5> numbers{
      {{"strength", &brush.strength},
       {"radius", &brush.radius_mm},
       {"softness", &brush.softness},
       {"depth", &brush.depth_mm},
       {"thickness", &brush.thickness_mm}}};
  for (const auto& [known, number] : numbers) {
    if (name == known && as_number(value, *number)) return ok();
  }
  return invalid_argument(fmt::format("brush {} {}: unknown, or no number", name, value));
}

Result<std::string> save_object(ViewModel& model,
                                const std::string& object,
                                const std::string& file) {
  const auto& objects = model.scene().objects;
  const auto found = std::ranges::find(objects, object, &render::ObjectOptions::name);
  const auto place = static_cast<std::size_t>(found - objects.begin());
  render::TranslucentBody* const body =
      found == objects.end() ? nullptr : model.renderer().body(place);
  if (body == nullptr) return not_found(fmt::format("no translucent object \"{}\"", object));
  const auto origin = body->save(system_files(), file, fmt::format("opaline-view {}", version()));
  if (!origin) return origin.error();
  return fmt::format(
      "{}: origin = [\"{} mm\", \"{} mm\", \"{} mm\"]", file, origin->x, origin->y, origin->z);
}

}  // namespace opaline::daemon
