#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "module/view/mesh.h"
#include "module/xr/held_model.h"

namespace palpate::headset {

/// The triangles of a glTF 2.0 model, and the nodes that carry them. A value.
struct GltfModel {
  struct GltfNode {
    std::string name;
    int parent = -1;  ///< index of a node before this one; -1: the model itself
    glm::dmat4 parent_from_node{1.0};
  };
  struct GltfPart {
    int node = 0;
    std::shared_ptr<const Mesh> mesh;
  };
  std::vector<GltfNode> nodes;
  std::vector<GltfPart> parts;
};

/// Reads a binary glTF 2.0 (GLB) with everything in it: triangles with normals and one set of
/// texture coordinates, base colour and its texture. Skins, morph targets, animations and
/// extensions are left out, as are files beside it. Takes tens of ms; any thread. kBadInput in a
/// sentence.
Result<GltfModel> read_gltf(std::span<const uint8_t> glb);

/// The meshes of a model where the runtime has it now. Nodes that `held` says are moved or hidden;
/// names that the model lacks are ignored.
std::vector<PlacedMesh> placed(const GltfModel& model, const xr::HeldModel& held);

}  // namespace palpate::headset
