#include "module/view/mesh_list.h"

#include <algorithm>
#include <map>

#include "module/view/refill.h"
#include "shaders/interface/view.h"

namespace palpate::view {

using namespace view_shaders;

const MeshList::Resident* MeshList::find(const std::shared_ptr<const Mesh>& mesh) const {
  const auto at = std::find_if(residents_.begin(), residents_.end(),
                               [&](const Resident& known) { return known.mesh == mesh; });
  return at == residents_.end() ? nullptr : &*at;
}

void MeshList::upload(const std::vector<PlacedMesh>& meshes) {
  residents_.clear();
  std::vector<MeshVertex> vertices;
  std::vector<uint32_t> corners, texels;
  std::map<const MeshTexture*, glm::ivec4> placed_textures;
  const auto place = [&](const std::shared_ptr<const MeshTexture>& texture) {
    glm::ivec4& at = placed_textures[texture.get()];
    if (at.y > 0) return at;
    at = {int(texels.size()), texture->width, texture->height, texture->levels};
    texels.insert(texels.end(), texture->texels.begin(), texture->texels.end());
    return at;
  };
  for (const PlacedMesh& placed : meshes) {
    if (find(placed.mesh)) continue;
    const Mesh& mesh = *placed.mesh;
    Resident& resident = residents_.emplace_back();
    resident.mesh = placed.mesh;
    resident.first_vertex = int(vertices.size());
    resident.first_triangle = int(corners.size() / 3);
    for (const Mesh::Vertex& vertex : mesh.vertices)
      vertices.push_back({glm::vec4(vertex.at, 1.0F), glm::vec4(vertex.normal, 0.0F),
                          glm::vec4(vertex.texture, 0.0F, 0.0F)});
    for (const glm::uvec3& triangle : mesh.triangles)
      corners.insert(corners.end(), {triangle.x, triangle.y, triangle.z});
    if (mesh.texture) resident.texture = place(mesh.texture);
  }
  refill(context_, vertices, vertices_);
  refill(context_, corners, triangles_);
  // A buffer of no texels can not be bound.
  if (texels.empty()) texels.push_back(0);
  refill(context_, texels, texels_);
}

void MeshList::show(const std::vector<PlacedMesh>& meshes, PictureSize size, int eyes) {
  if (std::any_of(meshes.begin(), meshes.end(),
                  [&](const PlacedMesh& placed) { return !find(placed.mesh); }))
    upload(meshes);
  std::vector<MeshPart> parts;
  std::vector<glm::uvec4> items;
  for (const PlacedMesh& placed : meshes) {
    const Mesh& mesh = *placed.mesh;
    const Resident& resident = *find(placed.mesh);
    const auto triangles = uint32_t(mesh.triangles.size());
    for (uint32_t eye = 0; eye < uint32_t(eyes); ++eye)
      for (uint32_t first = 0; first < triangles; first += kItemTriangles)
        items.emplace_back(parts.size(), eye, first,
                           std::min(uint32_t(kItemTriangles), triangles - first));
    MeshPart& part = parts.emplace_back();
    const glm::dmat4 rows = glm::transpose(placed.world_from_mesh);
    for (int row = 0; row < 3; ++row) part.world_from_mesh[row] = rows[row];
    part.first = {resident.first_triangle, resident.first_vertex, 0, 0};
    part.texture = resident.texture;
    part.colour = glm::vec4(mesh.colour, 1.0F);
  }
  size_ = size;
  eyes_ = eyes;
  item_count_ = int(items.size());
  if (items.empty()) return;
  const uint64_t bytes = 4 * uint64_t(size.width) * uint64_t(size.height) * uint64_t(eyes);
  if (nearest_.bytes() < bytes) nearest_ = vulkan::Buffer(context_, bytes);
  refill(context_, parts, parts_);
  refill(context_, items, items_);
}

void MeshList::record(vulkan::Recorder& recorder, Kernels& kernels, int pass,
                      const vulkan::Buffer& parameters, const vulkan::Buffer& depth) const {
  if (item_count_ == 0) return;
  if (pass == 0) recorder.fill(nearest_, 0);
  recorder.dispatch(kernels.meshes(pass),
                    {parameters, vertices_, triangles_, parts_, items_, depth, nearest_}, nullptr,
                    {item_count_, 1, 1});
}

void MeshList::record_colours(vulkan::Recorder& recorder, Kernels& kernels,
                              const vulkan::Buffer& parameters,
                              const vulkan::Buffer& colour) const {
  if (item_count_ == 0) return;
  recorder.dispatch(kernels.mesh_colours(),
                    {parameters, vertices_, triangles_, parts_, items_, texels_, nearest_, colour},
                    nullptr, {(size_.width + 7) / 8, (size_.height + 7) / 8, eyes_});
}

}  // namespace palpate::view
