#pragma once

#include <vector>

namespace opaline::capture {

/// Solves a x = b by Cholesky's factors, which take a's place; a is symmetric positive definite, row-major.
std::vector<double> solve_cholesky(std::vector<double>& a, std::vector<double> b);

}  // namespace opaline::capture
