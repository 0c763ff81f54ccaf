#include "integration/headset/held_models.h"

#include <algorithm>
#include <chrono>

#include "compute/vulkan/caught.h"

namespace palpate::headset {

std::vector<PlacedMesh> HeldModels::show(const std::vector<xr::HeldModel>& held) {
  // What the runtime has forgotten: only this map refers to it.
  std::erase_if(known_, [](const auto& entry) { return entry.second.asset.use_count() == 1; });
  std::vector<PlacedMesh> meshes;
  for (const xr::HeldModel& model : held) {
    ModelReading& known = known_[model.asset.get()];
    if (!known.asset) {
      known.asset = model.asset;
      known.reading = std::async(std::launch::async, [asset = model.asset]() -> Result<GltfModel> {
        return caught([&]() -> Result<GltfModel> { return read_gltf(asset->glb); });
      });
    }
    if (known.reading.valid() &&
        known.reading.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
      Result<GltfModel> read = known.reading.get();
      if (read)
        known.model = std::move(*read);
      else if (read.error().message != told_)
        trouble_ = told_ = read.error().message;
    }
    if (!known.model) continue;
    const std::vector<PlacedMesh> now = placed(*known.model, model);
    meshes.insert(meshes.end(), now.begin(), now.end());
  }
  return meshes;
}

}  // namespace palpate::headset
