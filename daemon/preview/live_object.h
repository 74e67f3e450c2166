#pragma once

#include <chrono>
#include <filesystem>
#include <stop_token>

#include "base/result.h"
#include "base/session_directory.h"
#include "gpu/context.h"

namespace opaline::daemon {

/// An object of a session's material, shown while it is edited: preview/object.toml, drawn by the renderer of "opaline render"
/// (DrawBy::kAuto), and drawn again whenever it changes. Pictures and figures go to the live view (daemon/live_view.h) in
/// preview/live/, whose lock keeps it to one; the session's own jobs are not in its way.
///
/// Its control.sock, there as well, takes beside "cancel" and "status" (daemon/jobs/control_server.h):
///
///   {"command":"edit","stroke":{...}}      another stroke in the last object (daemon/preview/stroke_text.h)
///   {"command":"undo"} {"command":"redo"}  of the strokes that came this way
///   {"command":"look","position_mm":[x,y,z],"target_mm":[x,y,z]}
///   {"command":"shine","light":0,"direction":[x,y,z]}
///
/// A stroke is written to preview/object.toml before it is answered, so the file always says what is shown; look and shine
/// last as long as the program. Whoever changes the file with an editor sees that, too, after the object is made ready anew;
/// a file with a mistake leaves the picture as it was, and the figures say what is wrong.
///
/// While wishes come in, diffuse light is that of Pace::kMoving; once nothing is wished, a picture with all light followed comes
/// after it ("settled"), unless another wish stops that.
///
/// Figures: "by": "object", "settled", "edits", "can_undo", "can_redo", "seconds" (the statistics' of the last picture), "iterations",
/// "relative_residual", "drawn_by", "message" (what went wrong last; empty: nothing).
struct LiveObjectOptions {
  std::chrono::seconds while_watched{0};  ///< ends once nobody has looked for so long; 0: Ctrl-C
  int threads = 0;                        ///< 0: one a processor
  gpu::ContextOptions gpu;
};

/// preview/live/
std::filesystem::path live_object_directory(const SessionDirectory& session);

/// Returns once it is to stop. Errors: kBusy while another shows it; kNotFound before there is a material; kInvalidArgument of a session that
/// measured no block; those of the first picture.
Result<void> show_object(const SessionDirectory& session,
                         const LiveObjectOptions& options,
                         std::stop_token stop);

}  // namespace opaline::daemon
