#pragma once

#include <vector>

#include "render/deform/deformation.h"

namespace opaline::render {

/// Free-form deformation by the control points of a box (make_deformation()). Needs valid options.
class Cage final : public Deformation {
 public:
  Cage(const DeformOptions& options, const Box& bounds);
  Vec3 at(Vec3 rest) const override;

 private:
  std::array<int, 3> points_;
  Box box_;
  std::vector<Vec3> moves_;  // of each control point, x fastest
};

}  // namespace opaline::render
