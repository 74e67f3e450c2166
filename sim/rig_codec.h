#pragma once

#include "base/frame.h"
#include "base/result.h"
#include "drivers/camera.h"
#include "drivers/projector.h"
#include "sim/rig_message.h"
#include "sim/rig_port.h"

/// The values of RigPort as messages, and back. What comes from outside is checked: sizes against the payload, types
/// against the names; whatever does not fit is kInvalidArgument.
namespace opaline::sim {

RigMessage encode(const Frame& frame);
RigMessage encode(const drivers::Pattern& pattern);
RigMessage encode(const RigStatus& status);
RigMessage encode(const RigTruth& truth);
RigMessage encode(const Faults& faults);
RigMessage encode(const RigPort::Opened<drivers::CameraInfo>& opened);
RigMessage encode(const RigPort::Opened<drivers::ProjectorInfo>& opened);
RigMessage encode(const Error& error);

Result<Frame> decode_frame(const RigMessage& message);
Result<drivers::Pattern> decode_pattern(const RigMessage& message);
Result<RigStatus> decode_status(const RigMessage& message);
Result<RigTruth> decode_truth(const RigMessage& message);
Result<Faults> decode_faults(const RigMessage& message);
Result<RigPort::Opened<drivers::CameraInfo>> decode_opened_camera(const RigMessage& message);
Result<RigPort::Opened<drivers::ProjectorInfo>> decode_opened_projector(const RigMessage& message);

/// The error that a reply carries, if it carries one.
Result<void> check_reply(const RigMessage& message);

}  // namespace opaline::sim
