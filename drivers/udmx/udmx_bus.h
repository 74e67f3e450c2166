#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace opaline::drivers {

/// A USB control write to a device (USB 2.0, 9.3): bmRequestType 0x40, vendor request, host to device.
struct UdmxRequest {
  std::uint8_t request = 0;  ///< bRequest
  std::uint16_t value = 0;   ///< wValue
  std::uint16_t index = 0;   ///< wIndex
};

/// One uDMX interface (VID 16C0, PID 05DC, Anyma's open hardware): 512 channels that it goes on sending, whatever becomes of its host,
/// until told otherwise. What it is told:
///
///   bRequest 1  one channel   wValue = value,  wIndex = channel from 0
///   bRequest 2  channel range wValue = count,  wIndex = first channel from 0, data = their values
///
/// Nothing else is ever sent: request 0x32 would start its boot loader.
class UdmxPort {
 public:
  virtual ~UdmxPort() = default;
  virtual std::string name() const = 0;  ///< where it is plugged in, "3-1.2"
  /// Errors: kTimeout, kUnavailable when it is gone or refuses.
  virtual Result<void> write(const UdmxRequest& request,
                             std::span<const std::uint8_t> data,
                             std::chrono::milliseconds patience) = 0;
};

/// Where interfaces are plugged in.
class UdmxBus {
 public:
  virtual ~UdmxBus() = default;
  /// Opens all there are, ordered by where they are plugged in. Errors: kUnavailable, with the remedy when the rights to open one are
  /// missing.
  virtual Result<std::vector<std::unique_ptr<UdmxPort>>> open_all() = 0;
};

/// The machine's USB, by libusb. Each set of ports has a libusb context of its own, so it may be used from any thread.
std::unique_ptr<UdmxBus> make_usb_bus();

}  // namespace opaline::drivers
