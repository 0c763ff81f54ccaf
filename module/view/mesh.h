#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

namespace palpate {

/// The picture on a mesh, in sizes from full to one texel: each has half the edges of the last
/// (rounded down, 1 at least).
struct MeshTexture {
  int width = 0, height = 0, levels = 0;
  std::vector<uint32_t> texels;  ///< sRGB, R in the lowest byte, rows from the top; all levels
};

/// A texture whose smaller levels are means, as light, of width * height pixels as above. Takes 0.1
/// s per million of them, so off the frame loop.
std::shared_ptr<const MeshTexture> mesh_texture(int width, int height,
                                                std::vector<uint32_t> pixels);

/// Opaque triangles of one material, drawn beside volumes, such as a part of a controller. Both
/// faces are seen. Given to the renderer by pointer: its content must not change.
struct Mesh {
  struct Vertex {
    glm::vec3 at{0.0F};       ///< in the mesh's own space, m
    glm::vec3 normal{0.0F};   ///< of any length; 0: that of the triangle
    glm::vec2 texture{0.0F};  ///< 0 to 1 from the texture's left and upper edge; it repeats beyond
  };
  std::vector<Vertex> vertices;
  std::vector<glm::uvec3> triangles;           ///< indices below vertices.size()
  glm::vec3 colour{1.0F};                      ///< linear; multiplied with the texture
  std::shared_ptr<const MeshTexture> texture;  ///< may be null
};

/// A mesh where it is to be drawn now.
struct PlacedMesh {
  std::shared_ptr<const Mesh> mesh;  ///< not null
  glm::dmat4 world_from_mesh{1.0};   ///< affine
  bool operator==(const PlacedMesh&) const = default;
};

}  // namespace palpate
