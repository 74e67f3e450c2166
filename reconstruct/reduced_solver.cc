#include "reconstruct/reduced_solver.h"

#include <optional>

#include "reconstruct/direct_light.h"
#include "reconstruct/inverse_solver.h"
#include "reconstruct/prediction.h"
#include "reconstruct/regrid.h"
#include "reconstruct/relighting_error.h"

namespace opaline::reconstruct {
namespace {

Result<void> put_back(const Dataset& dataset,
                      const InverseOptions& options,
                      diffusion::FluenceSolver& solver,
                      InverseResult& result,
                      std::stop_token stop) {
  result.material = on_grid(result.material, dataset.block);
  auto pictures = predict(dataset, result.material, options, solver, std::move(stop));
  if (!pictures) return pictures.error();
  result.predicted = *std::move(pictures);
  const Dataset counted = without_direct_light(dataset, result.direct_light_margin_mm);
  result.fitted = relighting_error(counted, result.predicted, false);
  result.held_out = relighting_error(counted, result.predicted, true);
  return ok();
}

}  // namespace

Result<InverseResult> reconstruct_reduced(const Dataset& dataset,
                                          const Reduction& reduction,
                                          const InverseOptions& options,
                                          const ReducedContext& context,
                                          std::stop_token stop) {
  const auto start = context.clock.now();
  const auto less = reduced(dataset, reduction);
  if (!less) return less.error();
  std::optional<CheckpointStore> store;
  if (context.files != nullptr)
    store.emplace(*context.files, context.checkpoints, fingerprint(*less, options));
  auto result = reconstruct_material(
      *less,
      options,
      {context.solver, context.events, context.clock, store ? &*store : nullptr, context.engine},
      stop);
  if (!result || reduction == Reduction{}) return result;
  auto back = put_back(dataset, options, context.solver, *result, std::move(stop));
  if (!back) return back.error();
  result->seconds = std::chrono::duration<double>(context.clock.now() - start).count();
  return result;
}

}  // namespace opaline::reconstruct
