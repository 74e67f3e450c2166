#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "drivers/light_stage.h"
#include "drivers/udmx/udmx_bus.h"

namespace opaline::drivers {

/// How lights hang on DMX. Channels count from 1 and go on over the interfaces: 513 is the first of the second one.
struct UdmxOptions {
  std::vector<SphereLight> lights;
  int first_channel = 1;       ///< of the first light
  int channels_per_light = 1;  ///< all of which get its code: 3 for one that takes red, green, blue
  std::vector<std::string>
      interfaces;  ///< where they are plugged in, in this order ("3-1.2"); empty: all, by place
  int polarizer_channel = 0;  ///< of what turns the camera's polariser; 0: it stands crossed
  std::uint8_t cross_code = 0;
  std::uint8_t parallel_code = 255;
  std::chrono::nanoseconds period{std::chrono::milliseconds(1)};     ///< of the lamps' dimming
  std::chrono::nanoseconds latency{std::chrono::milliseconds(200)};  ///< DMX line, lamps, polariser
};
/// Errors: kInvalidArgument.
Result<void> validate(const UdmxOptions& options);

/// A light stage on uDMX interfaces. Only what changes is sent: one channel by request 1, more by request 2 over the range that they span.
/// The interfaces go on shining when this process dies; opaline-guardian blanks them then (daemon/light_switch.h).
///
/// Threads: as LightStage says. Each transfer waits 250 ms at most, so that blank() over four interfaces keeps its second.
class UdmxStage : public LightStage {
 public:
  UdmxStage(UdmxOptions options, std::unique_ptr<UdmxBus> bus)
      : options_(std::move(options)), bus_(std::move(bus)) {}
  ~UdmxStage() override { close_dark(); }

  Result<void> open() override;
  Result<LightStageInfo> info() const override;
  Result<void> set(const StagePattern& pattern, std::stop_token stop) override;
  Result<void> blank() override;
  void close() noexcept override { close_dark(); }

 private:
  static constexpr std::size_t kChannels = 512;  // of an interface
  using Values = std::array<std::uint8_t, kChannels>;
  struct Interface {
    std::unique_ptr<UdmxPort> port;
    Values sent{};
  };
  using Interfaces = std::vector<Interface>;

  Result<Interfaces> open_interfaces();
  std::size_t used_channels() const;
  Result<void> send(Interface& interface, const Values& values, std::size_t used, bool all) const;
  Result<void> darken(Interfaces& interfaces) const;
  std::vector<Values> values_of(const StagePattern& pattern) const;
  LightStageInfo describe() const;
  void close_dark() noexcept;

  UdmxOptions options_;
  std::unique_ptr<UdmxBus> bus_;
  mutable std::mutex mutex_;
  Interfaces interfaces_;     // guarded by mutex_; none: closed
  std::uint64_t blanks_ = 0;  // guarded by mutex_
};

}  // namespace opaline::drivers
