#pragma once

#include <chrono>
#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "base/light_sphere.h"
#include "base/result.h"

namespace opaline::drivers {

/// How the camera's polariser stands to those before the lights. Cross-polarised pictures show what has scattered more than once;
/// parallel-polarised ones show that, single scattering and the specular reflection.
enum class Polarization : std::uint8_t { kCross, kParallel };

struct LightStageInfo {
  std::string model;
  std::string serial;
  std::vector<SphereLight> lights;  ///< where they are, and how bright at full code
  std::chrono::nanoseconds
      period{};  ///< of the lamps' dimming: exposures are whole multiples of it
  std::chrono::nanoseconds latency{};  ///< from set() to light, at most
  bool turns_polarizer = false;        ///< whether it can switch; if not, it is crossed
};

/// What all lights are to do at once.
struct StagePattern {
  std::uint64_t id = 0;             ///< > 0, unique within a session
  std::vector<std::uint8_t> codes;  ///< 0 to 255, light is proportional
  Polarization polarization = Polarization::kCross;
  std::string name = {};  ///< for people
};

/// A sphere of lights around an object, that shows one pattern until told otherwise.
///
///     closed --open()--> dark --set()--> lit --set()--> lit
///        ^                ^ |              |
///        +----close()-----+-+---blank()----+         device lost: closed, kUnavailable
///
/// open() and close() leave every light dark. set() returns once the pattern is *commanded*; light follows within the latency.
///
/// Threads: one caller at a time; blank() may come from any thread, and a set() that it overtakes ends dark.
/// Waits:   blank() at most 1 s, every other call 2 s, then kTimeout; a stop request ends set() with kCancelled within 300 ms, dark or
///          with the old pattern.
/// Errors:  kInvalidArgument for a pattern of the wrong size, id 0, or a polarisation that the stage cannot turn to;
///          kUnavailable while closed, when lost (the lights are in no known state), or blanked by somebody else; kNotFound where no
///          such device exists; kCancelled for a set() that blank() overtook.
class LightStage {
 public:
  virtual ~LightStage() = default;
  virtual Result<void> open() = 0;
  virtual Result<LightStageInfo> info() const = 0;
  virtual Result<void> set(const StagePattern& pattern, std::stop_token stop) = 0;
  /// Every light off; works whenever the device can be reached, also while closed.
  virtual Result<void> blank() = 0;
  virtual void close() noexcept = 0;
};

/// Errors: kInvalidArgument, as set() must answer.
Result<void> check(const StagePattern& pattern, const LightStageInfo& info);

}  // namespace opaline::drivers
