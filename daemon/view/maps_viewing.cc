#include "daemon/view/maps_viewing.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/files.h"
#include "base/io/image_io.h"
#include "daemon/report/picture.h"
#include "daemon/scattering/dipole_view.h"
#include "daemon/scattering/maps_scene.h"

namespace opaline::daemon {
namespace {

constexpr double kWaitSeconds = 0.05;
constexpr int kCoarsePixels = 40;  // of the longer side, while it turns
constexpr int kFinePixels = 144;
constexpr double kTurnedByPixel = 0.35;  // degrees
constexpr std::array kMapsVerbs{"orbit", "light", "exposure", "wait", "resize", "screenshot"};

/// What is looked at.
struct MapsDesk {
  double right = 0.0;  ///< degrees that the object is turned by
  double up = 0.0;
  bool even = true;  ///< constant light; else (1 + omega . d)/2
  double light_right = 0.0;
  double light_up = 0.0;
  double exposure = 0.0;
  bool operator==(const MapsDesk&) const = default;

  bool is_captured() const { return right == 0.0 && up == 0.0; }
  render::LinearLight light() const {
    if (even) return {1.0, {}};
    const double r = light_right * std::numbers::pi / 180.0;
    const double u = light_up * std::numbers::pi / 180.0;
    return {0.5, Vec3{std::sin(r) * std::cos(u), -std::sin(u), std::cos(r) * std::cos(u)} * 0.5};
  }
};

/// Root mean square difference over root mean square, over what the right one shows.
double apart(const Image<float>& captured, const Image<float>& rendered) {
  double off = 0.0;
  double square = 0.0;
  for (std::size_t n = 0; n < captured.samples().size(); ++n) {
    if (rendered.samples()[n] == 0.0F) continue;
    const double difference = rendered.samples()[n] - captured.samples()[n];
    off += difference * difference;
    square += captured.samples()[n] * captured.samples()[n];
  }
  return square > 0.0 ? std::sqrt(off / square) : 0.0;
}

/// A picture into a part of the window, as large as fits, each of the window's pixels from its nearest.
void fit_into(
    const Image<float>& picture, double white, int left, int width, Image<std::uint8_t>& window) {
  const Image<std::uint8_t> shown = tone_mapped(picture, white);
  const double scale =
      std::min(1.0 * width / picture.width(), 1.0 * window.height() / picture.height());
  const int across = static_cast<int>(scale * picture.width());
  const int down = static_cast<int>(scale * picture.height());
  const int x0 = left + (width - across) / 2;
  const int y0 = (window.height() - down) / 2;
  for (int y = 0; y < down; ++y)
    for (int x = 0; x < across; ++x)
      for (int c = 0; c < 3; ++c)
        window.at(x0 + x, y0 + y, c) =
            shown.at(std::min(picture.width() - 1, static_cast<int>(x / scale)),
                     std::min(picture.height() - 1, static_cast<int>(y / scale)),
                     c);
}

class MapsViewing {
 public:
  MapsViewing(const MapsViewingOptions& options, MapsScene scene)
      : options_(options), scene_(std::move(scene)) {}

  Result<void> run(const std::stop_token& stop) {
    auto window = ViewWindow::create(options_.window);
    if (!window) return window.error();
    window_ = *std::move(window);
    white_ = white_point(scene_.captured({1.0, {}}), 0.998);
    while (!stop.stop_requested() && !window_->wants_to_close() && !is_over())
      if (auto stepped = step(stop); !stepped) return stepped;
    return ok();
  }

 private:
  bool is_script_done() const { return next_ >= options_.script.size() && wait_ == 0; }
  bool is_told() const {
    return !options_.script.empty() || options_.frames > 0 || !options_.screenshot.empty();
  }
  bool is_over() const {
    return is_told() && is_script_done() && shown_ >= std::max(1, options_.frames) && kept_last_ &&
           screenshot_.empty();
  }

  Result<void> step(const std::stop_token& stop) {
    if (wait_ > 0) --wait_;
    act();
    window_->listen(is_told() ? 0.0 : kWaitSeconds);
    const auto size = window_->size();
    if (!size) return ok();
    window_->begin();
    follow_hand();
    const bool last = is_script_done() && shown_ + 1 >= options_.frames;
    if (last && screenshot_.empty() && !kept_last_) {
      screenshot_ = options_.screenshot;
      kept_last_ = true;
    }
    if (auto drawn = draw(size->width, size->height, stop); !drawn) return drawn;
    panel();  // says what was drawn
    return show();
  }

  void act() {
    if (wait_ > 0 || is_script_done() || !screenshot_.empty()) return;
    const ViewAction& a = options_.script[next_++];
    if (a.verb == "orbit") {
      desk_.right += a.number(0);
      desk_.up += a.number(1);
    }
    if (a.verb == "light") {
      desk_.even = false;
      desk_.light_right += a.number(1);
      desk_.light_up += a.number(2);
    }
    if (a.verb == "exposure") desk_.exposure = a.number(0);
    if (a.verb == "wait") wait_ = static_cast<int>(a.number(0));
    if (a.verb == "resize")
      window_->resize(static_cast<int>(a.number(0)), static_cast<int>(a.number(1)));
    if (a.verb == "screenshot") screenshot_ = a.words[0];
  }

  void follow_hand() {
    const ImGuiIO& io = ImGui::GetIO();
    turning_ = false;
    if (io.WantCaptureMouse || !ImGui::IsMouseDown(ImGuiMouseButton_Left)) return;
    const double right = kTurnedByPixel * io.MouseDelta.x;
    const double up = -kTurnedByPixel * io.MouseDelta.y;
    turning_ = true;
    if (io.KeyShift) {
      desk_.even = desk_.even && right == 0.0 && up == 0.0;
      desk_.light_right += right;
      desk_.light_up = std::clamp(desk_.light_up + up, -90.0, 90.0);
    } else {
      desk_.right += right;
      desk_.up = std::clamp(desk_.up - up, -90.0, 90.0);
    }
  }

  void panel() {
    ImGui::SetNextWindowPos({8.0F, 8.0F}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSize({300.0F, 190.0F}, ImGuiCond_FirstUseEver);
    ImGui::Begin("Opaline");
    ImGui::TextWrapped("%s: captured, and by dipoles from the maps", scene_.name().c_str());
    if (ImGui::Button("captured view")) desk_.right = desk_.up = 0.0;
    ImGui::SameLine();
    ImGui::Checkbox("even light", &desk_.even);
    float exposure = static_cast<float>(desk_.exposure);
    if (ImGui::SliderFloat("stops", &exposure, -4.0F, 4.0F)) desk_.exposure = exposure;
    ImGui::TextWrapped("%s", message_.c_str());
    ImGui::End();
  }

  Result<Image<float>> right_side(const std::stop_token& stop) {
    if (desk_.is_captured() && !scene_.has_mesh()) return scene_.rendered(desk_.light(), stop);
    return scene_.turned(desk_.right,
                         desk_.up,
                         desk_.light(),
                         turning_ && !is_told() ? kCoarsePixels : kFinePixels,
                         stop);
  }

  Result<void> draw(int width, int height, const std::stop_token& stop) {
    const bool coarse = turning_ && !is_told();
    if (picture_.width() == width && picture_.height() == height && drawn_ == desk_ &&
        coarse_ == coarse)
      return ok();
    const Image<float> captured = scene_.captured(desk_.light());
    const auto rendered = right_side(stop);
    if (!rendered) return rendered.error();
    message_ =
        desk_.is_captured()
            ? fmt::format("texture space: {:.1f} % apart", 100.0 * apart(captured, *rendered))
            : fmt::format("screen space: turned by {:.0f}, {:.0f} degrees", desk_.right, desk_.up);
    picture_ = Image<std::uint8_t>(width, height, 4);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) picture_.at(x, y, 3) = 255;
    const double white = white_ / std::exp2(desk_.exposure);
    fit_into(captured, white, 0, width / 2, picture_);
    fit_into(*rendered, white, width / 2, width - width / 2, picture_);
    drawn_ = desk_;
    coarse_ = coarse;
    return ok();
  }

  Result<void> show() {
    const bool keep = !screenshot_.empty();
    Image<std::uint8_t> seen;
    const auto shown = window_->present(picture_, keep ? &seen : nullptr);
    if (!shown) return shown.error();
    if (!*shown) return ok();
    ++shown_;
    if (!keep) return ok();
    const auto bytes = encode_image({std::move(seen), {}, {}}, ImageFormat::kPng);
    if (!bytes) return bytes.error();
    if (auto written = write_whole(system_files(), screenshot_, *bytes); !written) return written;
    fmt::print(stderr, "picture  {}\n", screenshot_.string());
    screenshot_.clear();
    return ok();
  }

  const MapsViewingOptions& options_;
  MapsScene scene_;
  std::unique_ptr<ViewWindow> window_;
  MapsDesk desk_;
  MapsDesk drawn_;
  Image<std::uint8_t> picture_;
  std::string message_;
  std::filesystem::path screenshot_;
  double white_ = 1.0;
  bool turning_ = false;
  bool coarse_ = false;
  bool kept_last_ = false;
  std::size_t next_ = 0;
  int wait_ = 0;
  int shown_ = 0;
};

}  // namespace

Result<void> view_maps(const MapsViewingOptions& options, std::stop_token stop) {
  for (const ViewAction& action : options.script)
    if (std::ranges::find(kMapsVerbs, action.verb) == kMapsVerbs.end())
      return invalid_argument(fmt::format(
          "--do {}: not of a session's maps, which know orbit, light, exposure, wait, resize and "
          "screenshot",
          action.verb));
  auto scene = MapsScene::open(options.session, {});
  if (!scene) return scene.error();
  return MapsViewing(options, *std::move(scene)).run(stop);
}

}  // namespace opaline::daemon
