// The geometric part of scripts/bench calibration alone: what is left of the reprojection, and how far lenses and lengths are from the truth.

#include "bench/calibrate/geometry_case.h"

int main() { return opaline::bench::print_geometry() ? 0 : 1; }
