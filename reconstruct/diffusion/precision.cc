#include "reconstruct/diffusion/precision.h"

namespace opaline::reconstruct::diffusion {

std::string_view to_string(Precision precision) {
  switch (precision) {
    case Precision::kHalf:
      return "half";
    case Precision::kSingle:
      return "single";
    case Precision::kDouble:
      return "double";
  }
  return "single";
}

}  // namespace opaline::reconstruct::diffusion
