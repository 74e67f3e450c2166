#pragma once

#include <string>

#include "render/view/view_model.h"

namespace opaline::daemon {

/// What a viewer's panels hold and say; no picture depends on more than `exposure` and `resolution`.
struct ViewDesk {
  render::EditOptions brush{.operation = render::EditOptions::Operation::kScale,
                            .value = {4.0, 4.0, 4.0},
                            .reach = render::EditOptions::Reach::kBall};
  bool painting = false;  ///< the left button paints; else it turns the camera
  int light = 0;          ///< the one that Shift and the left button turn
  double exposure = 0.0;  ///< stops
  double resolution = 1.0;
  std::string save_as = "painted.vdb";
  std::string message;  ///< what the last thing done led to
  double frame_seconds = 0.0;
};

/// Draws the panels into the user interface's frame and does what is asked for there. Problems become `desk.message`.
void draw_panels(render::ViewModel& model, ViewDesk& desk);

/// What the mouse does in the picture of that size in pixels: turn, move, zoom, paint, turn a light.
void follow_mouse(render::ViewModel& model, ViewDesk& desk, int width, int height);

/// A brush's property by name, as a script says it: operation, quantity, reach, value (three with commas), strength, radius, softness,
/// depth, thickness, mask. Errors: kInvalidArgument.
Result<void> set_brush(render::EditOptions& brush,
                       const std::string& name,
                       const std::string& value);

/// Writes an object's material. Errors: kNotFound for an unknown or opaque object, and those of write_material().
Result<std::string> save_object(render::ViewModel& model,
                                const std::string& object,
                                const std::string& file);

}  // namespace opaline::daemon
