#pragma once

/// Figures of how accurate the renderer's numerical ground is; what each prints: bench/render.cc.
namespace opaline::bench {

void measure_sphere();
void measure_accuracy();
void measure_geometry();
void measure_transport();
void measure_radiance();
void measure_directions();

}  // namespace opaline::bench
