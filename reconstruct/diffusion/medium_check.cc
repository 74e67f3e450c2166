#include "reconstruct/diffusion/medium_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace opaline::reconstruct::diffusion {
namespace {

std::string cell_name(const Block& block, std::size_t cell) {
  const auto nx = static_cast<std::size_t>(block.nx);
  const auto ny = static_cast<std::size_t>(block.ny);
  return fmt::format("cell ({}, {}, {})", cell % nx, cell / nx % ny, cell / (nx * ny));
}

Result<void> check_block(const Block& block) {
  if (block.nx < 1 || block.ny < 1 || block.nz < 1)
    return invalid_argument(
        fmt::format("block of {} x {} x {} cells; expected at least 1 along each axis",
                    block.nx,
                    block.ny,
                    block.nz));
  for (const double h : block.spacing())
    if (!(h > 0.0 && std::isfinite(h)))
      return invalid_argument(fmt::format("cell size {} mm; expected > 0", h));
  return ok();
}

Result<void> check_finite(const Block& block, const FieldBatch& fields, const char* name) {
  const auto bad = std::find_if_not(
      fields.values.begin(), fields.values.end(), [](double v) { return std::isfinite(v); });
  if (bad == fields.values.end()) return ok();
  const auto at = static_cast<std::size_t>(bad - fields.values.begin());
  return invalid_argument(fmt::format("{} of field {}, {}, is not finite",
                                      name,
                                      at / fields.cells,
                                      cell_name(block, at % fields.cells)));
}

Result<void> check_shape(const Block& block, const FieldBatch& fields, const char* name) {
  if (fields.cells != block.cell_count() || fields.count < 0 ||
      fields.values.size() != fields.cells * static_cast<std::size_t>(fields.count))
    return invalid_argument(
        fmt::format("{} holds {} values for {} fields of {} cells; the block has {} cells",
                    name,
                    fields.values.size(),
                    fields.count,
                    fields.cells,
                    block.cell_count()));
  return ok();
}

}  // namespace

Result<void> validate(const Medium& medium) {
  const Block& block = medium.block;
  if (Result<void> good = check_block(block); !good) return good;
  const std::size_t cells = block.cell_count();
  if (medium.diffusion.size() != cells || medium.absorption.size() != cells)
    return invalid_argument(fmt::format("{} diffusion and {} absorption values for {} cells",
                                        medium.diffusion.size(),
                                        medium.absorption.size(),
                                        cells));
  if (!(medium.boundary_a > 0.0 && std::isfinite(medium.boundary_a)))
    return invalid_argument(
        fmt::format("boundary constant A = {}; expected > 0", medium.boundary_a));
  for (std::size_t c = 0; c < cells; ++c) {
    if (!(medium.diffusion[c] > 0.0 && std::isfinite(medium.diffusion[c])))
      return invalid_argument(fmt::format(
          "diffusion of {} is {} mm; expected > 0", cell_name(block, c), medium.diffusion[c]));
    if (!(medium.absorption[c] >= 0.0 && std::isfinite(medium.absorption[c])))
      return invalid_argument(fmt::format("absorption of {} is {} per mm; expected >= 0",
                                          cell_name(block, c),
                                          medium.absorption[c]));
  }
  return ok();
}

Result<void> validate(const SolveOptions& options) {
  if (!(options.tolerance > 0.0 && std::isfinite(options.tolerance)))
    return invalid_argument(fmt::format("tolerance = {}; expected > 0", options.tolerance));
  if (options.max_iterations < 1)
    return invalid_argument(
        fmt::format("max_iterations = {}; expected >= 1", options.max_iterations));
  return ok();
}

Result<void> check_shapes(const Block& block, const FieldBatch& b, const FieldBatch& phi) {
  if (Result<void> good = check_shape(block, b, "the right-hand side"); !good) return good;
  if (Result<void> good = check_shape(block, phi, "the fluence"); !good) return good;
  if (b.count != phi.count)
    return invalid_argument(
        fmt::format("{} right-hand sides for {} fluence fields", b.count, phi.count));
  return ok();
}

Result<void> check_fields(const Block& block, const FieldBatch& b, const FieldBatch& phi) {
  if (Result<void> good = check_shapes(block, b, phi); !good) return good;
  if (Result<void> good = check_finite(block, b, "the right-hand side"); !good) return good;
  return check_finite(block, phi, "the starting fluence");
}

}  // namespace opaline::reconstruct::diffusion
