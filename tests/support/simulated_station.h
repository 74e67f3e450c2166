#pragma once

#include <memory>

#include "base/transport_responses.h"
#include "drivers/projector.h"
#include "sim/rig_options.h"

namespace opaline::support {

/// Responses of a made-up sample of 8 x 8 x 4 cells of 1 mm under 4 x 4 patches: each patch shines
/// through as a smooth hill on the seen face, mirror-symmetric, a little weaker from channel to
/// channel. For tests of what is built on responses, not of transport.
std::shared_ptr<const TransportResponses> tiny_responses();

/// A small, quick station for them: 64 x 64 camera pixels straight above the middle of the block,
/// 80 x 60 projector pixels of 0.2 mm, 40 of them across the lit face from pixel (20, 10); light
/// levels as in the demo.
sim::RigOptions tiny_rig();

/// A projector picture of one code throughout, sized for the options.
drivers::Pattern flat_pattern(const sim::RigOptions& options, std::uint64_t id, std::uint8_t code);

}  // namespace opaline::support
