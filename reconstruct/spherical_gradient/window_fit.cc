#include "reconstruct/spherical_gradient/window_fit.h"

#include "reconstruct/spherical_gradient/picture_arrays.h"
#include "reconstruct/spherical_gradient/window_rows.h"

namespace opaline::reconstruct {

PixelValues::PixelValues(int w, int h, ThreadTeam& team) : width(w), height(h) {
  const std::size_t count = static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
  assign_zeros({&normal_x,
                &normal_y,
                &normal_variance,
                &ratio,
                &ratio_variance,
                &reflectance,
                &reflectance_variance},
               count,
               team);
  measured.assign(count, 0);
}

void for_each_window(const PixelValues& p,
                     int half,
                     ThreadTeam& team,
                     const std::function<void(int x, int y, const WindowValues& window)>& f) {
  const int side = WindowRows::side_of(half);
  const int down = (p.height + side - 1) / side;
  team.run([&](int thread) {
    const int begin = down * thread / team.size();
    WindowRows rows(p, half, begin * side);
    for (int row = begin; row < down * (thread + 1) / team.size(); ++row) {
      rows.advance();
      rows.for_each([](std::size_t) { return true; }, f);
    }
  });
}

}  // namespace opaline::reconstruct
