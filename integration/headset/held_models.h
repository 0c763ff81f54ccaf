#pragma once

#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "integration/headset/gltf_model.h"

namespace palpate::headset {

/// What the person holds, as meshes. Models are read on threads of their own, and are left out
/// until that is done. One thread.
class HeldModels {
 public:
  /// The meshes of what is held now.
  std::vector<PlacedMesh> show(const std::vector<xr::HeldModel>& held);
  /// Why a model is not shown, each reason once: a sentence; or nothing.
  std::string take_trouble() { return std::exchange(trouble_, {}); }

 private:
  struct ModelReading {
    std::shared_ptr<const xr::ModelAsset> asset;  ///< kept, so that its address stays its own
    std::future<Result<GltfModel>> reading;       ///< valid until it is read
    std::optional<GltfModel> model;               ///< none: it is being read, or can not be
  };
  std::map<const xr::ModelAsset*, ModelReading> known_;
  std::string trouble_, told_;
};

}  // namespace palpate::headset
