#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "drivers/udmx/udmx_bus.h"

namespace opaline::support {

/// uDMX interfaces as their firmware behaves, with every byte that came over USB: what was said last goes on shining.
class FakeUdmx {
 public:
  struct Write {
    std::string place;
    drivers::UdmxRequest request;
    std::vector<std::uint8_t> data;
  };
  struct Interface {
    std::string place;
    bool plugged = true;
    std::array<std::uint8_t, 512> values{};
  };

  explicit FakeUdmx(const std::vector<std::string>& places) {
    for (const std::string& place : places) interfaces_.push_back({place});
  }
  std::unique_ptr<drivers::UdmxBus> bus() { return std::make_unique<Bus>(*this); }

  std::vector<Write> take_writes() {
    const std::lock_guard lock(mutex_);
    return std::exchange(writes_, {});
  }
  std::array<std::uint8_t, 512> values(std::size_t interface) const {
    const std::lock_guard lock(mutex_);
    return interfaces_[interface].values;
  }
  bool is_dark() const {
    const std::lock_guard lock(mutex_);
    return std::ranges::all_of(interfaces_, [](const Interface& i) {
      return std::ranges::all_of(i.values, [](std::uint8_t v) { return v == 0; });
    });
  }
  void plug(bool plugged) {
    const std::lock_guard lock(mutex_);
    for (Interface& interface : interfaces_) interface.plugged = plugged;
  }
  void plug(std::size_t interface, bool plugged) {
    const std::lock_guard lock(mutex_);
    interfaces_[interface].plugged = plugged;
  }
  /// Each transfer takes so long; beyond its patience it is a timeout.
  void slow_down(std::chrono::milliseconds transfer) {
    const std::lock_guard lock(mutex_);
    transfer_ = transfer;
  }

 private:
  class Port : public drivers::UdmxPort {
   public:
    Port(FakeUdmx& world, std::size_t at) : world_(world), at_(at) {}
    std::string name() const override { return world_.interfaces_[at_].place; }
    Result<void> write(const drivers::UdmxRequest& request,
                       std::span<const std::uint8_t> data,
                       std::chrono::milliseconds patience) override {
      return world_.write(at_, request, data, patience);
    }

   private:
    FakeUdmx& world_;
    std::size_t at_;
  };
  class Bus : public drivers::UdmxBus {
   public:
    explicit Bus(FakeUdmx& world) : world_(world) {}
    Result<std::vector<std::unique_ptr<drivers::UdmxPort>>> open_all() override {
      const std::lock_guard lock(world_.mutex_);
      std::vector<std::unique_ptr<drivers::UdmxPort>> ports;
      for (std::size_t n = 0; n < world_.interfaces_.size(); ++n)
        if (world_.interfaces_[n].plugged) ports.push_back(std::make_unique<Port>(world_, n));
      return ports;
    }

   private:
    FakeUdmx& world_;
  };

  Result<void> write(std::size_t at,
                     const drivers::UdmxRequest& request,
                     std::span<const std::uint8_t> data,
                     std::chrono::milliseconds patience) {
    const std::chrono::milliseconds taken = [&] {
      const std::lock_guard lock(mutex_);
      return std::min(transfer_, patience);
    }();
    std::this_thread::sleep_for(taken);
    const std::lock_guard lock(mutex_);
    Interface& interface = interfaces_[at];
    if (!interface.plugged) return unavailable("no such device (it may have been disconnected)");
    if (transfer_ > patience) return timeout("no answer");
    writes_.push_back({interface.place, request, {data.begin(), data.end()}});
    if (request.request == 1 && request.index < 512 && request.value < 256) {
      interface.values[request.index] = static_cast<std::uint8_t>(request.value);
      return ok();
    }
    if (request.request == 2 && request.index + request.value <= 512 &&
        data.size() == request.value) {
      std::ranges::copy(data, interface.values.begin() + request.index);
      return ok();
    }
    return unavailable("refused");
  }

  mutable std::mutex mutex_;
  std::vector<Interface> interfaces_;      // guarded by mutex_
  std::vector<Write> writes_;              // guarded by mutex_
  std::chrono::milliseconds transfer_{0};  // guarded by mutex_
};

}  // namespace opaline::support
