#pragma once

#include <vector>

#include "render/deform/deformation.h"

namespace opaline::render {

/// Linear blend skinning by bones (make_deformation()). Needs valid options.
class Skeleton final : public Deformation {
 public:
  explicit Skeleton(const DeformOptions& options);
  Vec3 at(Vec3 rest) const override;

 private:
  struct Carrier {
    Vec3 head;
    Vec3 along;  // to the tail
    Pose now_from_rest;
  };
  std::vector<Carrier> bones_;
};

}  // namespace opaline::render
