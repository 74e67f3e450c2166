#pragma once

#include <cstdint>

namespace opaline::sim {

/// A hash of two words in which every bit of either moves half the bits (the finaliser of
/// splitmix64, Steele et al. 2014): the random numbers of this directory are hashes of what they
/// are for, never of when they are drawn.
std::uint64_t mix(std::uint64_t a, std::uint64_t b);
/// In (0, 1), from the upper 53 bits of a hash.
double uniform(std::uint64_t hash);

}  // namespace opaline::sim
