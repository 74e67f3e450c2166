#pragma once

#include <cstddef>
#include <initializer_list>
#include <vector>

#include "base/thread_team.h"

namespace opaline::reconstruct {

/// Makes vectors of a picture's size and sets them to zero, several at a time and on large pages: of ten megapixels, getting the memory takes longer than using it.
void assign_zeros(std::initializer_list<std::vector<float>*> vectors,
                  std::size_t count,
                  ThreadTeam& team);

}  // namespace opaline::reconstruct
