#pragma once

/// Figures of how fast the renderer's numerical ground is; what each prints: bench/render.cc.
namespace opaline::bench {

void measure_mesh();
void measure_frames();
void measure_published();
void measure_raster();
void measure_growth();

}  // namespace opaline::bench
