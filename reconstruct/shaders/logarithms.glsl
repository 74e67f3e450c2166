// What the smoothness prior is about: log kappa and log sigma_a of a cell.
vec2 logarithms(int t) { return vec2(log(coefficient[t].x), p[push.cells.w + t]); }
