#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <vector>

#include "sim/camera_connection.h"
#include "sim/light_transport.h"
#include "sim/light_transport_medium.h"
#include "sim/photon_lanes.h"

namespace opaline::sim {

/// Sums over one batch, in units of emitted photons.
struct BatchSums {
  double specular = 0.0;
  double absorbed = 0.0;
  double unscattered = 0.0;
  std::array<double, 6> escaped{};
  std::array<std::vector<double>, 6> exitance;  ///< per face cell; empty when not tallied
  std::vector<double> radiance;  ///< per cell of the seen face; empty when not tallied

  void clear();
};

/// What all batches of a trace share. Everything it refers to must outlive the batches.
struct BatchSetup {
  const LightTransportMedium& medium;
  const LightEntry& entry;
  bool count_unscattered = false;
  const CameraConnection* camera = nullptr;  ///< null: no radiance
  StepFunction step = best_step_function();
  std::stop_token stop =
      {};  ///< looked at every thousand steps: a batch of trapped photons may take minutes
};

/// Follows kBatchPhotons photons with random numbers that depend on `key` alone and adds what they
/// do to `sums`, whose vectors have their sizes. Once stopped, what it has added is worth nothing. Threads: separate sums, any threads.
void trace_batch(const BatchSetup& setup, std::uint64_t key, BatchSums& sums);

}  // namespace opaline::sim
