#pragma once

#include <cstdint>
#include <string>

#include "base/dataset.h"
#include "base/transport_responses.h"

namespace opaline::bench {

/// Pictures made from stored light transport without a camera: noise of a given relative standard deviation is added,
/// and the transport's own variance counted.
struct TransportDatasetOptions {
  int regions = 4;      ///< n x n on the lit face, to fit; divides the number of patches
  double noise = 0.01;  ///< relative standard deviation added to every datum
  std::uint32_t seed = 1;
};

/// Regions for the fit; held out: "shifted" by half a region, "larger" (twice a region's side), "smaller" (one patch),
/// as far as they fit the face.
Dataset dataset_from_transport(const TransportResponses& responses,
                               const TransportDatasetOptions& options);

/// Every patch alone, held out, without added noise: what the BSSRDF error is taken over.
Dataset patch_dataset(const TransportResponses& responses);

}  // namespace opaline::bench
