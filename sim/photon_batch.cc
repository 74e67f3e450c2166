#include "sim/photon_batch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/fresnel.h"

namespace opaline::sim {
namespace {

constexpr double kRouletteSurvival = 0.1;
constexpr unsigned kStepsBetweenLooks = 1024;  // at the stop token

void clear_all(std::vector<double>& values) { std::fill(values.begin(), values.end(), 0.0); }

class PhotonBatch {
 public:
  PhotonBatch(const BatchSetup& setup, std::uint64_t key, BatchSums& sums)
      : setup_(setup), medium_(setup.medium), sums_(sums), random_(key) {
    const Block& block = medium_.block;
    const std::array<double, 3> size{block.size().x, block.size().y, block.size().z};
    for (int axis = 0; axis < 3; ++axis) {
      constants_.size[axis] = static_cast<float>(size[axis]);
      constants_.inverse_spacing[axis] = static_cast<float>(1.0 / block.spacing()[axis]);
      constants_.last_cell[axis] = block.cells()[axis] - 1;
    }
    constants_.stride_y = block.nx;
    constants_.stride_z = block.nx * block.ny;
    constants_.mean_free_path = static_cast<float>(1.0 / medium_.majorant);
    constants_.anisotropy = static_cast<float>(medium_.anisotropy);
    constants_.periodic_sides = medium_.periodic_sides;
    constants_.voxels = medium_.voxels.data();
    for (auto& word : lanes_.random) {
      for (std::uint32_t& lane : word) lane = static_cast<std::uint32_t>(random_.next() >> 32);
    }
  }

  void run() {
    for (int lane = 0; lane < kLanes; ++lane) emit(lane);
    for (unsigned steps = 1; living_ > 0; ++steps) {
      if (steps % kStepsBetweenLooks == 0 && setup_.stop.stop_requested()) return;
      handle_events(setup_.step(constants_, lanes_));
    }
    for (const float absorbed : lanes_.absorbed) sums_.absorbed += absorbed;
  }

 private:
  void handle_events(unsigned lanes) {
    for (; lanes != 0; lanes &= lanes - 1) {
      const int lane = std::countr_zero(lanes);
      const std::int32_t event = lanes_.event[lane];
      if ((event & kSeen) != 0) connect(lane);
      if ((event & kAtBoundary) != 0) meet_boundary(lane);
      if ((event & kDim) != 0) play_roulette(lane);
    }
  }

  void connect(int lane) {
    std::array<double, 3> point{};
    std::array<double, 3> direction{};
    for (int axis = 0; axis < 3; ++axis) {
      point[axis] = lanes_.position[axis][lane];
      direction[axis] = lanes_.arrived_along[axis][lane];
    }
    const VoxelOptics& voxel = medium_.voxels[cell_at(point)];
    const double chance = static_cast<double>(voxel.look) / voxel.accept;
    setup_.camera->connect(
        point, direction, lanes_.weight[lane] / chance, random_.uniform(), sums_.radiance);
  }

  std::size_t cell_at(const std::array<double, 3>& point) const {
    std::array<int, 3> cell{};  // by the step's own arithmetic, so that it is the step's cell
    for (int axis = 0; axis < 3; ++axis) {
      const float scaled = static_cast<float>(point[axis]) * constants_.inverse_spacing[axis];
      cell[axis] = std::min(static_cast<int>(scaled), constants_.last_cell[axis]);
    }
    return medium_.block.index(cell[0], cell[1], cell[2]);
  }

  void play_roulette(int lane) {
    if (random_.uniform() < kRouletteSurvival) {
      lanes_.weight[lane] /= static_cast<float>(kRouletteSurvival);
    } else {
      emit(lane);
    }
  }

  // Moves the photon to the boundary and reflects it there, or lets it go. Its next free path
  // starts afresh.
  void meet_boundary(int lane) {
    int face_axis = 2;
    float nearest = std::numeric_limits<float>::max();
    for (int axis = constants_.periodic_sides ? 2 : 0; axis < 3; ++axis) {
      const float along = lanes_.direction[axis][lane];
      if (along == 0.0F) continue;
      const float to = along > 0.0F ? constants_.size[axis] : 0.0F;
      const float distance = (to - lanes_.position[axis][lane]) / along;
      if (distance < nearest) {
        nearest = distance;
        face_axis = axis;
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      float& p = lanes_.position[axis][lane];
      const float size = constants_.size[axis];
      p += nearest * lanes_.direction[axis][lane];
      if (constants_.periodic_sides && axis != 2) p -= size * std::floor(p / size);
      p = std::clamp(p, 0.0F, size);
    }
    float& along = lanes_.direction[face_axis][lane];
    lanes_.position[face_axis][lane] = along > 0.0F ? constants_.size[face_axis] : 0.0F;
    const double reflected = reflectance(std::abs(along), medium_.ior, 1.0);
    if (reflected < 1.0 && random_.uniform() >= reflected) {
      escape(lane, static_cast<std::size_t>(face_axis) * 2 + (along > 0.0F ? 1 : 0));
      emit(lane);
    } else {
      along = -along;
    }
  }

  void escape(int lane, std::size_t face) {
    const double weight = lanes_.weight[lane];
    if (lanes_.scattered[lane] == 0 && !setup_.count_unscattered) {
      sums_.unscattered += weight;
      return;
    }
    sums_.escaped[face] += weight;
    std::vector<double>& exitance = sums_.exitance[face];
    if (exitance.empty()) return;
    const int axis = static_cast<int>(face) / 2;
    const int column_axis = axis == 0 ? 1 : 0;
    const int row_axis = axis == 2 ? 1 : 2;
    const auto cell = [&](int a) {
      return std::min(static_cast<int>(lanes_.position[a][lane] * constants_.inverse_spacing[a]),
                      constants_.last_cell[a]);
    };
    const int width = constants_.last_cell[column_axis] + 1;
    exitance[static_cast<std::size_t>(cell(row_axis)) * width + cell(column_axis)] += weight;
  }

  // Starts the next photon in a lane, or puts the lane to rest.
  void emit(int lane) {
    const bool was_alive = lanes_.alive[lane] != 0;
    if (emitted_ == kBatchPhotons) {
      if (was_alive) --living_;
      lanes_.alive[lane] = 0;
      lanes_.weight[lane] = 0.0F;
      return;
    }
    ++emitted_;
    if (!was_alive) ++living_;
    lanes_.alive[lane] = -1;
    lanes_.scattered[lane] = 0;
    enter(lane);
  }

  void enter(int lane) {
    const LightEntry& entry = setup_.entry;
    const int axis = axis_of(entry.face);
    const int column_axis = axis == 0 ? 1 : 0;
    const int row_axis = axis == 2 ? 1 : 2;
    const double inward = is_max(entry.face) ? -1.0 : 1.0;
    const double u = random_.uniform();
    const double v = random_.uniform();
    set_position(
        lane, column_axis, entry.column_begin + u * (entry.column_end - entry.column_begin));
    set_position(lane, row_axis, entry.row_begin + v * (entry.row_end - entry.row_begin));
    lanes_.position[axis][lane] = is_max(entry.face) ? constants_.size[axis] : 0.0F;
    const double outer_sine_squared = entry.diffuse ? random_.uniform() : 0.0;
    const double sine = std::sqrt(outer_sine_squared) / medium_.ior;
    lanes_.direction[axis][lane] = static_cast<float>(inward * std::sqrt(1.0 - sine * sine));
    const double azimuth = entry.diffuse ? 2.0 * std::numbers::pi * random_.uniform() : 0.0;
    lanes_.direction[column_axis][lane] =
        static_cast<float>(entry.diffuse ? sine * std::cos(azimuth) : 0.0);
    lanes_.direction[row_axis][lane] =
        static_cast<float>(entry.diffuse ? sine * std::sin(azimuth) : 0.0);
    const double lost = reflectance(std::sqrt(1.0 - outer_sine_squared), 1.0, medium_.ior);
    sums_.specular += lost;
    lanes_.weight[lane] = static_cast<float>(1.0 - lost);
  }

  void set_position(int lane, int axis, double value) {
    lanes_.position[axis][lane] =
        std::clamp(static_cast<float>(value), 0.0F, constants_.size[axis]);
  }

  const BatchSetup& setup_;
  const LightTransportMedium& medium_;
  BatchSums& sums_;
  SplitMix random_;
  StepConstants constants_{};
  PhotonLanes lanes_{};
  std::uint64_t emitted_ = 0;
  int living_ = 0;
};

}  // namespace

void BatchSums::clear() {
  specular = absorbed = unscattered = 0.0;
  escaped.fill(0.0);
  for (std::vector<double>& face : exitance) clear_all(face);
  clear_all(radiance);
}

void trace_batch(const BatchSetup& setup, std::uint64_t key, BatchSums& sums) {
  PhotonBatch(setup, key, sums).run();
}

}  // namespace opaline::sim
