#include "reconstruct/model_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/ensure.h"

namespace opaline::reconstruct {
namespace {

constexpr int kCoarse = 4;  // cells a node along the lit face

Parametrization both(const FieldBasis& basis) { return {basis, basis}; }

struct Sums {
  double chi_squared = 0.0;
  double count = 0.0;
};

Sums sums_of(const Misfit& misfit) {
  Sums sums;
  for (const Misfit::Picture& p : misfit.pictures) {
    sums.chi_squared += p.chi_squared;
    sums.count += static_cast<double>(p.count);
  }
  return sums;
}

// Variance of a ratio of sums over blocks: `of(m)` over the counts, whose ratio is `mean`.
template <class Of>
double block_variance(const Misfit& misfit, double mean, Of of) {
  const auto blocks = static_cast<double>(
      std::ranges::count_if(misfit.pictures, [](const Misfit::Picture& p) { return p.count > 0; }));
  if (blocks < 2.0) return 0.0;
  double scatter = 0.0;
  double count = 0.0;
  for (std::size_t m = 0; m < misfit.pictures.size(); ++m) {
    const auto n = static_cast<double>(misfit.pictures[m].count);
    scatter += std::pow(of(m) - mean * n, 2);
    count += n;
  }
  return blocks / (blocks - 1.0) * scatter / (count * count);
}

}  // namespace

std::vector<ModelRung> models_to_try(Model choice, const Block& block, Face lit_face) {
  std::vector<ModelRung> rungs{
      {Model::kHomogeneous, "homogeneous", both(FieldBasis::homogeneous(block))}};
  const auto add = [&](Model model, std::string name, const FieldBasis& basis) {
    if (basis.size() > rungs.back().parametrization.reduced_scattering().size())
      rungs.push_back({model, std::move(name), both(basis)});
  };
  if (choice == Model::kAuto || choice == Model::kLayered)
    add(Model::kLayered, "layered", FieldBasis::layered(block, lit_face));
  if (choice == Model::kAuto) {
    add(Model::kHeterogeneous,
        fmt::format("heterogeneous, a node every {} cells", kCoarse),
        FieldBasis::columns(block, lit_face, kCoarse));
  }
  if (choice == Model::kAuto || choice == Model::kHeterogeneous)
    add(Model::kHeterogeneous, "heterogeneous", FieldBasis::full(block));
  return rungs;
}

double Misfit::per_datum() const {
  const Sums sums = sums_of(*this);
  return sums.count > 0.0 ? sums.chi_squared / sums.count : 0.0;
}

double Misfit::standard_error() const {
  const double count = sums_of(*this).count;
  if (count == 0.0) return 0.0;
  const double blocks =
      block_variance(*this, per_datum(), [&](std::size_t m) { return pictures[m].chi_squared; });
  return std::sqrt(std::max(blocks, 2.0 / count));
}

Misfit misfit(const ChannelProblem& problem, std::vector<std::vector<double>> radiance) {
  ENSURE(radiance.size() == problem.illuminations.size());
  Misfit out;
  for (std::size_t m = 0; m < radiance.size(); ++m) {
    const ChannelIllumination& data = problem.illuminations[m];
    Misfit::Picture picture;
    for (std::size_t x = 0; x < data.weight.size(); ++x) {
      if (!(data.weight[x] > 0.0)) continue;
      picture.chi_squared += data.weight[x] * std::pow(radiance[m][x] - data.radiance[x], 2);
      ++picture.count;
    }
    picture.radiance = std::move(radiance[m]);
    out.pictures.push_back(std::move(picture));
  }
  return out;
}

bool is_explained(const Misfit& misfit) {
  return misfit.per_datum() <= 1.0 + misfit.standard_error();
}

Gain gain(const ChannelProblem& problem, const Misfit& simpler, const Misfit& finer) {
  const double count = sums_of(simpler).count;
  if (count == 0.0) return {};
  const double mean = simpler.per_datum() - finer.per_datum();
  const double blocks = block_variance(simpler, mean, [&](std::size_t m) {
    return simpler.pictures[m].chi_squared - finer.pictures[m].chi_squared;
  });
  double independent = 0.0;
  for (std::size_t m = 0; m < simpler.pictures.size(); ++m) {
    const ChannelIllumination& data = problem.illuminations[m];
    for (std::size_t x = 0; x < data.weight.size(); ++x) {
      const double apart = simpler.pictures[m].radiance[x] - finer.pictures[m].radiance[x];
      independent += 4.0 * data.weight[x] * apart * apart;
    }
  }
  return {mean, std::sqrt(std::max(blocks, independent / (count * count)))};
}

}  // namespace opaline::reconstruct
