#include <fmt/format.h>
#include <libusb-1.0/libusb.h>

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/udmx/udmx_bus.h"

namespace opaline::drivers {
namespace {

constexpr std::uint16_t kVendor = 0x16C0;
constexpr std::uint16_t kProduct = 0x05DC;
constexpr std::uint8_t kVendorWrite = 0x40;

using Context = std::shared_ptr<libusb_context>;
using Handle = std::unique_ptr<libusb_device_handle, decltype(&libusb_close)>;

Error usb_error(int code, const std::string& where) {
  if (code == LIBUSB_ERROR_TIMEOUT)
    return timeout(fmt::format("uDMX interface at {}: no answer", where));
  if (code == LIBUSB_ERROR_ACCESS)
    return unavailable(
        fmt::format("uDMX interface at {}: no right to open it; a udev rule gives it: "
                    "SUBSYSTEM==\"usb\", ATTR{{idVendor}}==\"16c0\", ATTR{{idProduct}}==\"05dc\", "
                    "MODE=\"0660\", GROUP=\"plugdev\"",
                    where));
  return unavailable(fmt::format("uDMX interface at {}: {}", where, libusb_strerror(code)));
}

/// "3-1.2": bus and ports, as the kernel writes it.
std::string place_of(libusb_device* device) {
  std::array<std::uint8_t, 7> ports{};
  const int count = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string place = fmt::format("{}", libusb_get_bus_number(device));
  for (int n = 0; n < count; ++n)
    place += fmt::format("{}{}", n == 0 ? '-' : '.', ports[static_cast<std::size_t>(n)]);
  return place;
}

bool is_udmx(libusb_device* device) {
  libusb_device_descriptor descriptor{};
  return libusb_get_device_descriptor(device, &descriptor) == LIBUSB_SUCCESS &&
         descriptor.idVendor == kVendor && descriptor.idProduct == kProduct;
}

class UsbPort : public UdmxPort {
 public:
  UsbPort(Context context, Handle handle, std::string place)
      : context_(std::move(context)), handle_(std::move(handle)), place_(std::move(place)) {}

  std::string name() const override { return place_; }

  Result<void> write(const UdmxRequest& request,
                     std::span<const std::uint8_t> data,
                     std::chrono::milliseconds patience) override {
    std::vector<std::uint8_t> bytes(data.begin(), data.end());  // libusb wants them writable
    const int sent = libusb_control_transfer(handle_.get(),
                                             kVendorWrite,
                                             request.request,
                                             request.value,
                                             request.index,
                                             bytes.data(),
                                             static_cast<std::uint16_t>(bytes.size()),
                                             static_cast<unsigned int>(patience.count()));
    if (sent < 0) return usb_error(sent, place_);
    if (static_cast<std::size_t>(sent) == data.size()) return ok();
    return unavailable(
        fmt::format("uDMX interface at {}: took {} of {} bytes", place_, sent, data.size()));
  }

 private:
  Context context_;  // outlives the handle
  Handle handle_;
  std::string place_;
};

class UsbBus : public UdmxBus {
 public:
  Result<std::vector<std::unique_ptr<UdmxPort>>> open_all() override {
    libusb_context* made = nullptr;
    if (const int code = libusb_init(&made); code != LIBUSB_SUCCESS)
      return unavailable(fmt::format("USB: {}", libusb_strerror(code)));
    const Context context(made, libusb_exit);
    libusb_device** listed = nullptr;
    const auto count = libusb_get_device_list(context.get(), &listed);
    if (count < 0)
      return unavailable(fmt::format("USB: {}", libusb_strerror(static_cast<int>(count))));
    const auto free_list = [](libusb_device** list) { libusb_free_device_list(list, 1); };
    const std::unique_ptr<libusb_device*, decltype(free_list)> list(listed, free_list);
    std::vector<std::unique_ptr<UdmxPort>> ports;
    for (libusb_device* device : std::span(listed, static_cast<std::size_t>(count))) {
      if (!is_udmx(device)) continue;
      std::string place = place_of(device);
      libusb_device_handle* handle = nullptr;
      if (const int code = libusb_open(device, &handle); code != LIBUSB_SUCCESS)
        return usb_error(code, place);
      ports.push_back(
          std::make_unique<UsbPort>(context, Handle(handle, libusb_close), std::move(place)));
    }
    std::ranges::sort(ports, {}, [](const auto& port) { return port->name(); });
    return ports;
  }
};

}  // namespace

std::unique_ptr<UdmxBus> make_usb_bus() { return std::make_unique<UsbBus>(); }

}  // namespace opaline::drivers
