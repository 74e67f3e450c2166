#include "reconstruct/diffusion/reference_solver.h"

#include "tests/reconstruct/support/solver_truths.h"

namespace opaline::reconstruct::diffusion::testing {

struct ReferenceFactory {
  static std::unique_ptr<FluenceSolver> make() { return make_reference_solver(); }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Reference, SolverTruths, ReferenceFactory);

}  // namespace opaline::reconstruct::diffusion::testing
