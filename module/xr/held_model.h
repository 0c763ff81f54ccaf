#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "module/xr/pose.h"

namespace palpate::xr {

/// The shape of a controller as its runtime gives it.
struct ModelAsset {
  std::vector<uint8_t> glb;               ///< a binary glTF 2.0, m
  std::vector<std::string> moving_nodes;  ///< names of its nodes that move, such as a trigger's
};

/// A node that moves, now.
struct ModelNodePlace {
  Pose parent_from_node;  ///< instead of the transform that the asset has for it
  bool visible = true;    ///< with all nodes below it
};

/// A controller that the person holds, at the display time.
struct HeldModel {
  std::shared_ptr<const ModelAsset> asset;  ///< not null; the same pointer is the same content
  Pose world_from_model;
  std::vector<ModelNodePlace> nodes;  ///< as asset->moving_nodes
};

}  // namespace palpate::xr
