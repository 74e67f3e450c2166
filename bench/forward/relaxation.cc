#include <algorithm>
#include <chrono>
#include <vector>

#include "bench/forward/forward_case.h"

namespace opaline::bench {
namespace {

using reconstruct::diffusion::FieldBatch;
using reconstruct::diffusion::Medium;

constexpr int kLanes = 16;        // right-hand sides side by side, where they are batched
constexpr int kLook = 20;         // sweeps between two looks at the error
constexpr int kLooksARound = 20;  // before what is left is put on the right-hand side
constexpr int kCoarseSweeps = 400;
constexpr int kMostSweeps = 200000;

/// One grid: face conductances towards the higher index, 1 / diagonal, light and fluence.
struct Grid {
  Medium medium;
  std::vector<float> gx, gy, gz, inverse;
  std::vector<float> b, u, next;  // cell by cell, `lanes` each
  int lanes = kLanes;             // or 1
};

/// Half as many cells along every axis that has two and more, each with the mean of those it covers.
Medium coarsened(const Medium& fine) {
  const Block& f = fine.block;
  const auto half = [](int n) { return std::max(1, n / 2); };
  const Block c{half(f.nx),
                half(f.ny),
                half(f.nz),
                f.size().x / half(f.nx),
                f.size().y / half(f.ny),
                f.size().z / half(f.nz)};
  Medium coarse{c,
                std::vector<double>(c.cell_count(), 0.0),
                std::vector<double>(c.cell_count(), 0.0),
                fine.boundary_a};
  std::vector<int> covered(c.cell_count(), 0);
  for (int k = 0; k < f.nz; ++k)
    for (int j = 0; j < f.ny; ++j)
      for (int i = 0; i < f.nx; ++i) {
        const std::size_t to = c.index(i * c.nx / f.nx, j * c.ny / f.ny, k * c.nz / f.nz);
        coarse.diffusion[to] += fine.diffusion[f.index(i, j, k)];
        coarse.absorption[to] += fine.absorption[f.index(i, j, k)];
        ++covered[to];
      }
  for (std::size_t n = 0; n < covered.size(); ++n) {
    coarse.diffusion[n] /= covered[n];
    coarse.absorption[n] /= covered[n];
  }
  return coarse;
}

/// `values` of the fine grid's cells, summed where a coarse cell covers them.
std::vector<float> gathered(const Block& f,
                            const Block& c,
                            const std::vector<float>& values,
                            int lanes) {
  std::vector<float> sums(c.cell_count() * lanes, 0.0F);
  for (int k = 0; k < f.nz; ++k)
    for (int j = 0; j < f.ny; ++j)
      for (int i = 0; i < f.nx; ++i) {
        const std::size_t from = f.index(i, j, k) * lanes;
        const std::size_t to = c.index(i * c.nx / f.nx, j * c.ny / f.ny, k * c.nz / f.nz) * lanes;
        for (int m = 0; m < lanes; ++m) sums[to + m] += values[from + m];
      }
  return sums;
}

void scatter(const Grid& coarse, Grid& fine) {
  const Block& f = fine.medium.block;
  const Block& c = coarse.medium.block;
  for (int k = 0; k < f.nz; ++k)
    for (int j = 0; j < f.ny; ++j)
      for (int i = 0; i < f.nx; ++i)
        std::copy_n(
            coarse.u.begin() +
                static_cast<std::ptrdiff_t>(
                    c.index(i * c.nx / f.nx, j * c.ny / f.ny, k * c.nz / f.nz) * fine.lanes),
            fine.lanes,
            fine.u.begin() + static_cast<std::ptrdiff_t>(f.index(i, j, k) * fine.lanes));
}

Grid make_grid(Medium medium, std::vector<float> light, int lanes) {
  Grid grid{std::move(medium), {}, {}, {}, {}, std::move(light), {}, {}, lanes};
  const Block& block = grid.medium.block;
  const auto& kappa = grid.medium.diffusion;
  const std::size_t n = block.cell_count();
  for (auto* g : {&grid.gx, &grid.gy, &grid.gz, &grid.inverse}) g->assign(n, 0.0F);
  grid.u.assign(n * lanes, 0.0F);
  grid.next.assign(n * lanes, 0.0F);
  std::vector<double> diagonal(n);
  for (std::size_t c = 0; c < n; ++c) diagonal[c] = block.cell_volume() * grid.medium.absorption[c];
  const std::array<std::vector<float>*, 3> conductances{&grid.gx, &grid.gy, &grid.gz};
  const std::array<std::size_t, 3> stride{
      1, static_cast<std::size_t>(block.nx), static_cast<std::size_t>(block.nx) * block.ny};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double h = block.spacing()[axis];
    const double area = block.cell_volume() / h;
    const auto count = static_cast<std::size_t>(block.cells()[axis]);
    for (std::size_t c = 0; c < n; ++c) {
      const std::size_t at = c / stride[axis] % count;
      const double wall = area / (2.0 * grid.medium.boundary_a + h / (2.0 * kappa[c]));
      if (at == 0) diagonal[c] += wall;
      if (at + 1 == count) {
        diagonal[c] += wall;
        continue;
      }
      const std::size_t other = c + stride[axis];
      const double g = area / h * 2.0 * kappa[c] * kappa[other] / (kappa[c] + kappa[other]);
      (*conductances[axis])[c] = static_cast<float>(g);
      diagonal[c] += g;
      diagonal[other] += g;
    }
  }
  for (std::size_t c = 0; c < n; ++c) grid.inverse[c] = static_cast<float>(1.0 / diagonal[c]);
  return grid;
}

/// next = (b + sum g u) / D along one row of cells.
__attribute__((target_clones("avx512f", "avx2", "default"))) void relax_row(Grid& grid,
                                                                            int j,
                                                                            int k) {
  const Block& block = grid.medium.block;
  const auto nx = static_cast<std::size_t>(block.nx);
  const std::size_t plane = nx * static_cast<std::size_t>(block.ny);
  const std::size_t row = block.index(0, j, k);
  for (std::size_t c = row; c < row + nx; ++c) {
    float sum[kLanes];
    const float* b = grid.b.data() + c * kLanes;
    for (int m = 0; m < kLanes; ++m) sum[m] = b[m];
    const auto add = [&](float g, std::size_t from) {
      const float* u = grid.u.data() + from * kLanes;
      for (int m = 0; m < kLanes; ++m) sum[m] += g * u[m];
    };
    if (c > row) add(grid.gx[c - 1], c - 1);
    if (c + 1 < row + nx) add(grid.gx[c], c + 1);
    if (j > 0) add(grid.gy[c - nx], c - nx);
    if (j + 1 < block.ny) add(grid.gy[c], c + nx);
    if (k > 0) add(grid.gz[c - plane], c - plane);
    if (k + 1 < block.nz) add(grid.gz[c], c + plane);
    float* next = grid.next.data() + c * kLanes;
    const float inverse = grid.inverse[c];
    for (int m = 0; m < kLanes; ++m) next[m] = inverse * sum[m];
  }
}

/// The same for one right-hand side. Behind the last cell of a line gx is zero, and so it is before the first.
__attribute__((target_clones("avx512f", "avx2", "default"))) void relax_line(Grid& grid,
                                                                             int j,
                                                                             int k) {
  const Block& block = grid.medium.block;
  const auto nx = static_cast<std::ptrdiff_t>(block.nx);
  const std::ptrdiff_t plane = nx * block.ny;
  const auto row = static_cast<std::ptrdiff_t>(block.index(0, j, k));
  static const std::vector<float> zeros(1 << 16, 0.0F);
  const float* u = grid.u.data() + row;
  const auto g = [&](bool there, const std::vector<float>& values, std::ptrdiff_t back) {
    return there ? values.data() + row - back : zeros.data();
  };
  const float* gy_before = g(j > 0, grid.gy, nx);
  const float* gy_after = g(j + 1 < block.ny, grid.gy, 0);
  const float* gz_before = g(k > 0, grid.gz, plane);
  const float* gz_after = g(k + 1 < block.nz, grid.gz, 0);
  const float* y_before = j > 0 ? u - nx : u;
  const float* y_after = j + 1 < block.ny ? u + nx : u;
  const float* z_before = k > 0 ? u - plane : u;
  const float* z_after = k + 1 < block.nz ? u + plane : u;
  const float* gx = grid.gx.data() + row;
  const float* b = grid.b.data() + row;
  const float* inverse = grid.inverse.data() + row;
  float* next = grid.next.data() + row;
#pragma omp simd
  for (std::ptrdiff_t i = 0; i < nx; ++i)
    next[i] = b[i] + gy_before[i] * y_before[i] + gy_after[i] * y_after[i] +
              gz_before[i] * z_before[i] + gz_after[i] * z_after[i];
#pragma omp simd
  for (std::ptrdiff_t i = 1; i < nx; ++i) next[i] += gx[i - 1] * u[i - 1];
#pragma omp simd
  for (std::ptrdiff_t i = 0; i < nx - 1; ++i) next[i] += gx[i] * u[i + 1];
#pragma omp simd
  for (std::ptrdiff_t i = 0; i < nx; ++i) next[i] *= inverse[i];
}

void sweep(Grid& grid, int count) {
  const Block& block = grid.medium.block;
  for (int n = 0; n < count; ++n) {
#pragma omp parallel for schedule(static)
    for (int k = 0; k < block.nz; ++k)
      for (int j = 0; j < block.ny; ++j)
        grid.lanes == 1 ? relax_line(grid, j, k) : relax_row(grid, j, k);
    grid.u.swap(grid.next);
  }
}

/// What `found` and the sweeps since amount to.
FieldBatch fluence_of(const Grid& grid, const FieldBatch& found) {
  FieldBatch x = found;
  for (int m = 0; m < grid.lanes; ++m)
    for (std::size_t c = 0; c < x.cells; ++c) x.field(m)[c] += grid.u[c * grid.lanes + m];
  return x;
}

/// From here on the grid's sweeps are for what is missing at `found`.
void sweep_the_rest(const ForwardCase& problem,
                    const ExactMatrix& matrix,
                    const FieldBatch& found,
                    int first,
                    Grid& grid) {
  std::vector<double> rest(found.cells);
  for (int m = 0; m < grid.lanes; ++m) {
    matrix.residual(problem.b.field(first + m), found.field(m), rest.data());
    for (std::size_t c = 0; c < found.cells; ++c)
      grid.b[c * grid.lanes + m] = static_cast<float>(rest[c]);
  }
  std::fill(grid.u.begin(), grid.u.end(), 0.0F);
}

/// Illuminations first ... first + lanes.
RelaxationRun relax(const ForwardCase& problem,
                    const ExactMatrix& matrix,
                    const FieldBatch& exact,
                    double error,
                    int first,
                    int lanes) {
  FieldBatch wanted(exact.cells, lanes);
  std::copy_n(exact.field(first), wanted.values.size(), wanted.values.begin());
  std::vector<float> light(problem.b.cells * lanes);
  for (int m = 0; m < lanes; ++m)
    for (std::size_t c = 0; c < problem.b.cells; ++c)
      light[c * lanes + m] = static_cast<float>(problem.b.field(first + m)[c]);
  RelaxationRun run;
  auto start = std::chrono::steady_clock::now();
  const auto stop_clock = [&] {
    run.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  std::vector<Grid> grids;
  grids.push_back(make_grid(problem.medium, std::move(light), lanes));
  while (grids.back().medium.block.cell_count() > 200) {
    const Grid& fine = grids.back();
    Medium coarse = coarsened(fine.medium);
    std::vector<float> b = gathered(fine.medium.block, coarse.block, fine.b, lanes);
    grids.push_back(make_grid(std::move(coarse), std::move(b), lanes));
  }
  for (std::size_t level = grids.size() - 1; level > 0; --level) {
    sweep(grids[level], kCoarseSweeps);
    scatter(grids[level], grids[level - 1]);
  }
  Grid& finest = grids.front();
  FieldBatch found(exact.cells, lanes);
  stop_clock();
  for (int look = 1;; ++look) {
    start = std::chrono::steady_clock::now();
    sweep(finest, kLook);
    stop_clock();
    run.sweeps += kLook;
    FieldBatch now = fluence_of(finest, found);
    run.error = front_face_error(problem, now, wanted);
    if (run.error <= error || run.sweeps >= kMostSweeps) break;
    if (look % kLooksARound != 0) continue;
    found = std::move(now);
    sweep_the_rest(problem, matrix, found, first, finest);
  }
  return run;
}

}  // namespace

RelaxationRun run_relaxation(const ForwardCase& problem, const FieldBatch& exact, double error) {
  return relax(problem, ExactMatrix(problem.medium), exact, error, 0, kLanes);
}

RelaxationRun run_published_relaxation(const ForwardCase& problem,
                                       const FieldBatch& exact,
                                       double error,
                                       int count) {
  const ExactMatrix matrix(problem.medium);
  RelaxationRun all;
  for (int first = 0; first < count; ++first) {
    const RelaxationRun one = relax(problem, matrix, exact, error, first, 1);
    all.seconds += one.seconds * problem.b.count / count;
    all.sweeps = std::max(all.sweeps, one.sweeps);
    all.error = std::max(all.error, one.error);
  }
  return all;
}

}  // namespace opaline::bench
