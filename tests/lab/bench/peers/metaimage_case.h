#pragma once

#include <string>

#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

namespace palpate::peers {

/// A pair whose motion is known: what a peer is judged on.
struct KnownPair {
  Volume fixed;
  Volume moving;
  Field truth;  ///< on the fixed image's grid
  Mask body;    ///< where to score
};

/// Reads PREFIX_fixed.mha, PREFIX_moving.mha, PREFIX_truth.mha and PREFIX_body.mha with ITK's
/// MetaImage reader. Errors: a file that is missing or broken, or that lies on another grid than
/// the fixed image.
Result<KnownPair> read_known_pair(const std::string& prefix);

/// Endpoint error |u - truth| inside the body, in the two units that are both called voxel when
/// spacing is uneven.
struct EndpointError {
  double mean_voxels = 0;  ///< each component divided by its own axis' spacing
  double p95_voxels = 0;
  double mean_finest = 0;  ///< mm divided by the finest spacing: larger or equal
  double p95_finest = 0;
};

/// How far a field on the fixed image's grid is from the truth.
EndpointError endpoint_error(const Field& field, const KnownPair& pair);

}  // namespace palpate::peers
