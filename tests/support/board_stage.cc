#include "tests/support/board_stage.h"

#include <fmt/format.h>

#include "calibration/board_finder.h"

namespace opaline::support {
namespace {

constexpr int kWidth = 480;
constexpr int kHeight = 360;
constexpr double kExposure = 1.0 / 30.0;
constexpr double kLeastModulation = 20.0;  // codes, of 4095

}  // namespace

BoardStage::BoardStage(calibration::Board::Kind kind, int poses) {
  camera.model = sim::board_camera(kWidth, kHeight);
  scene.board = {.kind = kind == calibration::Board::Kind::kCharuco
                             ? sim::SimBoardKind::kCharuco
                             : sim::SimBoardKind::kChessboard,
                 .squares_x = 10,
                 .squares_y = 7,
                 .square_mm = 13.0,
                 .marker_mm = 8.0,
                 .margin_mm = 6.0};
  if (kind == calibration::Board::Kind::kCharuco) {
    scene.board.squares_x = 7;
    scene.board.squares_y = 5;
    scene.board.square_mm = 20.0;
    scene.board.marker_mm = 14.0;
  }
  board = {.kind = kind,
           .squares_x = scene.board.squares_x,
           .squares_y = scene.board.squares_y,
           .square_mm = scene.board.square_mm,
           .marker_mm = scene.board.marker_mm};
  scene.projector = sim::board_projector(projector.width, projector.height);
  scene.poses = sim::held_poses(scene.board, camera.model, scene.projector, 350.0, poses, 7);
  plan = {.width = projector.width, .height = projector.height, .gamma = projector.gamma};
}

Image<std::uint16_t> BoardStage::photograph(std::size_t pose,
                                            const Image<std::uint8_t>& grey_codes) {
  if (!optics_) {
    optics_ = std::make_unique<sim::BoardOptics>(camera, projector, scene);
    sensor_ = std::make_unique<sim::Sensor>(camera, 1);
  }
  Image<std::uint8_t> codes(grey_codes.width(), grey_codes.height(), 3);
  for (std::size_t i = 0; i < codes.samples().size(); ++i)
    codes.samples()[i] = grey_codes.samples()[i / 3];
  Image<float> light = optics_->light_of(scene.poses[pose], codes).sensor_radiance;
  for (float& v : light.samples()) v *= static_cast<float>(kExposure);
  return sensor_->read(light, kExposure, ++key_);
}

calibration::BoardView BoardStage::camera_view(std::size_t pose) {
  const auto frame =
      photograph(pose, Image<std::uint8_t>(projector.width, projector.height, 1, 255));
  return *calibration::find_board(
      calibration::grey_of(frame), board, fmt::format("pose {}", pose + 1));
}

calibration::ProjectorMap BoardStage::projector_map(std::size_t pose) {
  std::vector<Image<float>> pictures;
  for (int i = 0; i < plan.count(); ++i) {
    const auto frame = photograph(pose, calibration::phase_pattern(plan, i));
    Image<float> grey(frame.width(), frame.height(), 1);
    for (std::size_t s = 0; s < frame.samples().size(); ++s)
      grey.samples()[s / 3] += static_cast<float>(frame.samples()[s]) / 3.0f;
    pictures.push_back(std::move(grey));
  }
  return *calibration::decode_phases(plan, pictures, kLeastModulation);
}

}  // namespace opaline::support
