#include "calibration/posing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "calibration/board_finder.h"
#include "calibration/lens_fit.h"
#include "calibration/pose_guide.h"

namespace opaline::calibration {
namespace {

constexpr std::size_t kEnoughToTell = 6;
constexpr double kElsewhere = 0.02;   // of the picture's width
constexpr double kStandsStill = 0.5;  // px, from one picture to the next
constexpr std::chrono::milliseconds kBetweenLooks{200};
constexpr std::chrono::seconds kBlink{1};

PoseGuide guide_of(const StepContext& context, const Poses& poses) {
  return guide_poses(context.taker.camera().width,
                     context.taker.camera().height,
                     context.geometry.board,
                     poses.camera);
}

// A person lives in real time, however fast the station's clock is.
std::chrono::nanoseconds persons(const FrameTaker& taker, std::chrono::nanoseconds time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(taker.pace() * time);
}

/// Waits for the next pose in white light.
class PoseWait {
 public:
  PoseWait(StepContext& context, const Brightness& brightness, const Poses& poses)
      : context_(context),
        brightness_(brightness),
        poses_(poses),
        guide_(guide_of(context, poses)),
        deadline_(context.taker.now() + persons(context.taker, kPosePatience)) {}

  enum class End : std::uint8_t { kReady, kEnough, kNobody };

  Result<End> wait() {
    for (;;) {
      const PoseAnswer answer = context_.attendant->answer();
      if (answer == PoseAnswer::kEnough) return End::kEnough;
      if (auto looked = look(); !looked) return looked.error();
      if (answer == PoseAnswer::kTake || ready_) return End::kReady;
      if (context_.taker.now() > deadline_) return End::kNobody;
      if (auto waited = context_.taker.pause(persons(context_.taker, kBetweenLooks), context_.stop);
          !waited)
        return waited.error();
    }
  }
  /// Why it is not taken yet.
  const std::string& doing() const { return doing_; }

 private:
  Result<void> look() {
    const auto frame = context_.taker.lit(brightness_.light, brightness_.turns, context_.stop);
    if (!frame) return frame.error();
    const Image<std::uint8_t> grey = grey_of(frame->pixels);
    auto view = find_board(grey, context_.geometry.board, "the board");
    if (!view) return view.error();
    judge(*view);
    const int pose = static_cast<int>(poses_.camera.size()) + 1;
    context_.attendant->saw(
        PoseSight{grey, *view, guide_, pose, context_.geometry.poses, false, doing_});
    context_.progress(static_cast<double>(pose - 1) / context_.geometry.poses,
                      fmt::format("pose {} of {}: {}", pose, context_.geometry.poses, doing_));
    last_ = *std::move(view);
    return ok();
  }

  void judge(const BoardView& view) {
    const double width = context_.taker.camera().width;
    const std::string wish = "hold the board " + guide_.wish;
    if (!view.fault.empty()) {
      doing_ = fmt::format("{} ({})", wish, view.fault);
    } else if (stands_where_it_was(view, kElsewhere * width)) {
      doing_ = wish;
    } else if (!last_ || corners_moved(*last_, view).value_or(kStandsStill + 1.0) > kStandsStill) {
      doing_ = "hold it still";
    } else {
      doing_ = "taking it";
      ready_ = true;
    }
  }

  bool stands_where_it_was(const BoardView& view, double far) const {
    return std::ranges::any_of(poses_.camera, [&](const BoardView& old) {
      return old.fault.empty() && corners_moved(old, view).value_or(far + 1.0) <= far;
    });
  }

  StepContext& context_;
  const Brightness& brightness_;
  const Poses& poses_;
  PoseGuide guide_;
  std::chrono::nanoseconds deadline_;
  std::optional<BoardView> last_;
  std::string doing_;
  bool ready_ = false;
};

BoardView nobodys(const std::string& name, const std::string& doing) {
  BoardView view;
  view.name = name;
  view.fault =
      fmt::format("not taken: within {} s nobody did as asked: {}", kPosePatience.count(), doing);
  return view;
}

nlohmann::json pose_fact(const PoseGuide& guide, const BoardView& view, int pose, int poses) {
  const PoseLie& lie = guide.lies.back();
  return {{"pose", pose},
          {"poses", poses},
          {"corners", view.corners.size()},
          {"blur_px", view.blur_px},
          {"fault", view.fault},
          {"tilt_deg", lie.tilt_deg()},
          {"distance_mm", lie.distance_mm},
          {"fields", guide.fields},
          {"coverage", guide.coverage},
          {"tilts",
           {{"left", guide.left_nearer},
            {"right", guide.right_nearer},
            {"top", guide.top_nearer},
            {"bottom", guide.bottom_nearer},
            {"flat", guide.flat}}}};
}

// How well a lens fits all poses so far, and this one.
std::string fitted(const StepContext& context, const Poses& poses, nlohmann::json& fact) {
  if (poses.camera.size() < kEnoughToTell) return {};
  const auto fit = fit_lens(context.taker.camera().width,
                            context.taker.camera().height,
                            context.geometry.board,
                            poses.camera,
                            {},
                            context.stop);
  if (!fit) return {};
  fact["rms_px"] = fit->rms_px;
  const ViewFit& own = fit->views.back();
  if (!own.kept()) return fmt::format("; left out: {}", own.reason);
  fact["pose_rms_px"] = own.rms_px;
  return fmt::format("; reprojection {:.3f} px, of all {:.3f} px", own.rms_px, fit->rms_px);
}

// What the operator should know after a pose.
Result<void> tell_pose(StepContext& context, const Poses& poses) {
  const BoardView& view = poses.camera.back();
  const PoseGuide guide = guide_of(context, poses);
  const int pose = static_cast<int>(poses.camera.size());
  nlohmann::json fact = pose_fact(guide, view, pose, context.geometry.poses);
  std::string text = view.fault.empty()
                         ? fmt::format("{}: {} corners, tilted {:.0f} degrees, {:.0f} mm away",
                                       view.name,
                                       view.corners.size(),
                                       guide.lies.back().tilt_deg(),
                                       guide.lies.back().distance_mm)
                         : fmt::format("{}: {}", view.name, view.fault);
  text += fitted(context, poses, fact);
  text += fmt::format("; corners in {:.0f} % of the picture", 100.0 * guide.coverage);
  if (pose < context.geometry.poses) {
    fact["next"] = guide.wish;
    text += fmt::format("; next: the board {}", guide.wish);
  }
  fact["message"] = text;
  return context.events.fact("pose.taken", fact);
}

Result<PoseWait::End> make_room(StepContext& context,
                                const Brightness& brightness,
                                const Poses& poses,
                                std::string& doing) {
  const bool waits = context.attendant != nullptr && context.attendant->holds_the_board();
  const std::chrono::nanoseconds dark =
      waits ? persons(context.taker, kBlink) : context.geometry.time_to_move;
  if (auto rested = context.taker.rest(dark, context.stop); !rested) return rested.error();
  if (!waits) return PoseWait::End::kReady;
  PoseWait wait(context, brightness, poses);
  auto end = wait.wait();
  doing = wait.doing();
  return end;
}

Result<void> take_one(StepContext& context,
                      const std::string& name,
                      const Brightness& brightness,
                      Poses& poses) {
  auto pose = take_pose(context, name, brightness);
  if (!pose) return pose.error().in(name);
  poses.camera.push_back(pose->camera);
  poses.projector.push_back(pose->projector);
  poses.paper.push_back(pose->paper);
  if (context.attendant != nullptr) {
    const PoseGuide guide = guide_of(context, poses);
    context.attendant->saw(PoseSight{pose->grey,
                                     pose->camera,
                                     guide,
                                     static_cast<int>(poses.camera.size()),
                                     context.geometry.poses,
                                     true,
                                     pose->camera.fault.empty() ? "taken" : pose->camera.fault});
  }
  return ok();
}

}  // namespace

Result<Poses> take_poses(StepContext& context, const Brightness& brightness) {
  Poses poses;
  const int count = context.geometry.poses;
  for (int i = 0, nobody = 0; i < count; ++i) {
    const std::string name = fmt::format("pose {}", i + 1);
    context.progress(static_cast<double>(i) / count,
                     fmt::format("{} of {}: move the board, then hold it still", name, count));
    std::string doing;
    const auto end = make_room(context, brightness, poses, doing);
    if (!end) return end.error().in(name);
    if (*end == PoseWait::End::kEnough) return poses;
    if (*end == PoseWait::End::kNobody) {
      if (++nobody == kNobodyThere)
        return timeout(
            fmt::format("nobody came to hold the board for {} poses in a row ({})", nobody, doing));
      poses.camera.push_back(nobodys(name, doing));
      poses.projector.push_back(poses.camera.back());
      poses.paper.emplace_back();
    } else {
      nobody = 0;
      if (auto taken = take_one(context, name, brightness, poses); !taken) return taken.error();
    }
    if (auto told = tell_pose(context, poses); !told) return told.error();
  }
  return poses;
}

}  // namespace opaline::calibration
