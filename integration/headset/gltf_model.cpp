#include "integration/headset/gltf_model.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <map>
#include <optional>

namespace palpate::headset {
namespace {

constexpr size_t kMostTriangles = 2'000'000;
constexpr int kMostTexels = 1024;  // along an edge; larger textures are halved

Error refused(const std::string& what) {
  return {ErrorKind::kBadInput, "The model can not be read: " + what + "."};
}

/// Finds no file: a model has to bring everything with it.
template <class Callbacks>
Callbacks no_files() {
  Callbacks none{};
  none.FileExists = [](const std::string&, void*) { return false; };
  none.ExpandFilePath = [](const std::string& path, void*) { return path; };
  none.ReadWholeFile = [](std::vector<unsigned char>*, std::string* error, const std::string&,
                          void*) {
    if (error) *error = "it needs a file beside it";
    return false;
  };
  none.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&,
                           void*) { return false; };
  // Since version 2.9.
  if constexpr (requires { none.GetFileSizeInBytes; })
    none.GetFileSizeInBytes = [](size_t*, std::string*, const std::string&, void*) {
      return false;
    };
  return none;
}

/// An image that can not be read is left empty, instead of giving up the model.
bool read_image(tinygltf::Image* image, int index, std::string* error, std::string* warning,
                int width, int height, const unsigned char* bytes, int size, void*) {
  if (!tinygltf::LoadImageData(image, index, error, warning, width, height, bytes, size, nullptr)) {
    image->image.clear();
    image->width = image->height = 0;
  }
  return true;
}

/// The elements of an accessor, whose bytes are known to be there.
struct Elements {
  const uint8_t* first = nullptr;
  size_t count = 0, stride = 0;
  int component = 0;  ///< TINYGLTF_COMPONENT_TYPE_...
  int width = 0;      ///< components
  /// A component as it is stored.
  double at(size_t element, int part) const {
    const uint8_t* bytes =
        first + element * stride +
        size_t(part) * size_t(tinygltf::GetComponentSizeInBytes(uint32_t(component)));
    const auto read = [&](auto value) {
      std::memcpy(&value, bytes, sizeof value);
      return double(value);
    };
    switch (component) {
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return read(uint8_t());
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return read(uint16_t());
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return read(uint32_t());
      default:
        return read(float());
    }
  }
  /// Of texture coordinates: integers stand for 0 to 1.
  double share(size_t element, int part) const {
    const double value = at(element, part);
    return component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? value / 255.0
           : component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? value / 65535.0
                                                                 : value;
  }
};

template <class List>
bool has(const List& list, int index) {
  return index >= 0 && size_t(index) < list.size();
}

std::optional<Elements> elements_of(const tinygltf::Model& gltf, int index, int width) {
  if (!has(gltf.accessors, index)) return std::nullopt;
  const tinygltf::Accessor& accessor = gltf.accessors[size_t(index)];
  if (accessor.sparse.isSparse || !has(gltf.bufferViews, accessor.bufferView)) return std::nullopt;
  const tinygltf::BufferView& view = gltf.bufferViews[size_t(accessor.bufferView)];
  if (!has(gltf.buffers, view.buffer)) return std::nullopt;
  const int type = accessor.componentType;
  if (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
      type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
      type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT && type != TINYGLTF_COMPONENT_TYPE_FLOAT)
    return std::nullopt;
  if (tinygltf::GetNumComponentsInType(uint32_t(accessor.type)) != width) return std::nullopt;
  const auto size = size_t(width) * size_t(tinygltf::GetComponentSizeInBytes(uint32_t(type)));
  const size_t stride = view.byteStride ? view.byteStride : size;
  const std::vector<unsigned char>& bytes = gltf.buffers[size_t(view.buffer)].data;
  // Each of these may be any number in a broken file: no sum or product of them may wrap.
  if (view.byteOffset > bytes.size() || view.byteLength > bytes.size() - view.byteOffset ||
      accessor.byteOffset > view.byteLength || stride < size || stride > 255 ||
      accessor.count == 0 || accessor.count > bytes.size())
    return std::nullopt;
  if (stride * (accessor.count - 1) + size > view.byteLength - accessor.byteOffset)
    return std::nullopt;
  return Elements{bytes.data() + view.byteOffset + accessor.byteOffset, accessor.count, stride,
                  type, width};
}

/// All materials that share an image share its texture, too.
using Textures = std::map<int, std::shared_ptr<const MeshTexture>>;

std::shared_ptr<const MeshTexture> texture_of(const tinygltf::Model& gltf, int index,
                                              Textures& textures) {
  if (!has(gltf.textures, index)) return nullptr;
  const int source = gltf.textures[size_t(index)].source;
  if (!has(gltf.images, source)) return nullptr;
  const auto known = textures.find(source);
  if (known != textures.end()) return known->second;
  const tinygltf::Image& image = gltf.images[size_t(source)];
  const auto bytes = size_t(image.bits / 8);
  const size_t pixels = size_t(std::max(image.width, 0)) * size_t(std::max(image.height, 0));
  if (pixels == 0 || (bytes != 1 && bytes != 2) || image.component != 4 ||
      image.image.size() < 4 * bytes * pixels)
    return textures[source] = nullptr;
  std::vector<uint32_t> texels(pixels);
  for (size_t k = 0; k < pixels; ++k)
    for (size_t c = 0; c < 4; ++c)
      // Of 16 bits the upper byte, which is the second one.
      texels[k] |= uint32_t(image.image[(4 * k + c) * bytes + bytes - 1]) << (8 * c);
  auto made =
      std::make_shared<MeshTexture>(*mesh_texture(image.width, image.height, std::move(texels)));
  while (made->width > kMostTexels || made->height > kMostTexels) {
    made->texels.erase(made->texels.begin(),
                       made->texels.begin() + std::ptrdiff_t(made->width) * made->height);
    made->width = std::max(made->width / 2, 1);
    made->height = std::max(made->height / 2, 1);
    --made->levels;
  }
  return textures[source] = std::move(made);
}

Result<std::shared_ptr<const Mesh>> mesh_of(const tinygltf::Model& gltf,
                                            const tinygltf::Primitive& primitive,
                                            Textures& textures) {
  const auto attribute = [&](const char* name, int width) {
    const auto at = primitive.attributes.find(name);
    return at == primitive.attributes.end() ? std::nullopt : elements_of(gltf, at->second, width);
  };
  const auto places = attribute("POSITION", 3);
  if (!places || places->component != TINYGLTF_COMPONENT_TYPE_FLOAT)
    return refused("a part of it has no places of corners");
  const auto normals = attribute("NORMAL", 3), coordinates = attribute("TEXCOORD_0", 2);
  auto mesh = std::make_shared<Mesh>();
  for (size_t v = 0; v < places->count; ++v) {
    Mesh::Vertex& vertex = mesh->vertices.emplace_back();
    for (int c = 0; c < 3; ++c) {
      vertex.at[c] = float(places->at(v, c));
      if (normals && v < normals->count) vertex.normal[c] = float(normals->at(v, c));
      if (c < 2 && coordinates && v < coordinates->count)
        vertex.texture[c] = float(coordinates->share(v, c));
    }
    const float sum = vertex.at.x + vertex.at.y + vertex.at.z + vertex.normal.x + vertex.normal.y +
                      vertex.normal.z + vertex.texture.x + vertex.texture.y;
    if (!std::isfinite(sum)) return refused("it has numbers that are not finite");
  }
  std::vector<uint32_t> corners;
  if (primitive.indices >= 0) {
    const auto indices = elements_of(gltf, primitive.indices, 1);
    if (!indices || indices->component == TINYGLTF_COMPONENT_TYPE_FLOAT)
      return refused("a part of it has no list of triangles");
    for (size_t k = 0; k < indices->count; ++k) corners.push_back(uint32_t(indices->at(k, 0)));
  } else {
    for (size_t k = 0; k < places->count; ++k) corners.push_back(uint32_t(k));
  }
  if (corners.size() / 3 > kMostTriangles) return refused("it has too many triangles");
  for (size_t k = 0; k + 3 <= corners.size(); k += 3) {
    const glm::uvec3 triangle(corners[k], corners[k + 1], corners[k + 2]);
    if (std::max({triangle.x, triangle.y, triangle.z}) >= mesh->vertices.size())
      return refused("a triangle of it has a corner that is not there");
    mesh->triangles.push_back(triangle);
  }
  if (has(gltf.materials, primitive.material)) {
    const auto& look = gltf.materials[size_t(primitive.material)].pbrMetallicRoughness;
    for (size_t c = 0; c < 3 && look.baseColorFactor.size() >= 3; ++c)
      mesh->colour[int(c)] = float(std::clamp(look.baseColorFactor[c], 0.0, 1.0));
    if (look.baseColorTexture.texCoord == 0)
      mesh->texture = texture_of(gltf, look.baseColorTexture.index, textures);
  }
  return std::shared_ptr<const Mesh>(std::move(mesh));
}

glm::dmat4 transform_of(const tinygltf::Node& node) {
  if (node.matrix.size() == 16) return glm::make_mat4(node.matrix.data());
  glm::dmat4 transform(1.0);
  if (node.rotation.size() == 4)
    transform = glm::mat4_cast(glm::normalize(
        glm::dquat(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2])));
  for (int c = 0; c < 3; ++c) {
    if (node.scale.size() == 3) transform[c] *= node.scale[size_t(c)];
    if (node.translation.size() == 3) transform[3][c] = node.translation[size_t(c)];
  }
  return transform;
}

bool is_finite(const glm::dmat4& m) {
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r)
      if (!std::isfinite(m[c][r])) return false;
  return true;
}

}  // namespace

Result<GltfModel> read_gltf(std::span<const uint8_t> glb) {
  tinygltf::TinyGLTF reader;
  reader.SetFsCallbacks(no_files<tinygltf::FsCallbacks>());
  reader.SetImageLoader(read_image, nullptr);
  tinygltf::Model gltf;
  std::string error, warning;
  if (glb.empty() || glb.size() > 0xffffffffU ||
      !reader.LoadBinaryFromMemory(&gltf, &error, &warning, glb.data(), uint32_t(glb.size())))
    return refused("it is no binary glTF 2.0");
  if (!gltf.extensionsRequired.empty())
    return refused("it needs the extension " + gltf.extensionsRequired.front());
  GltfModel model;
  Textures textures;
  size_t triangles = 0;
  // Each node once, parents first; a broken file may have rings.
  std::vector<std::pair<int, int>> open;  // node, parent in the model
  std::vector<bool> seen(gltf.nodes.size(), false);
  if (has(gltf.scenes, std::max(gltf.defaultScene, 0)))
    for (const int root : gltf.scenes[size_t(std::max(gltf.defaultScene, 0))].nodes)
      open.emplace_back(root, -1);
  while (!open.empty()) {
    const auto [index, parent] = open.back();
    open.pop_back();
    if (!has(gltf.nodes, index) || seen[size_t(index)]) return refused("its nodes are not a tree");
    seen[size_t(index)] = true;
    const tinygltf::Node& node = gltf.nodes[size_t(index)];
    const auto number = int(model.nodes.size());
    model.nodes.push_back({node.name, parent, transform_of(node)});
    if (!is_finite(model.nodes.back().parent_from_node))
      return refused("it has numbers that are not finite");
    for (const int child : node.children) open.emplace_back(child, number);
    if (!has(gltf.meshes, node.mesh)) continue;
    for (const tinygltf::Primitive& primitive : gltf.meshes[size_t(node.mesh)].primitives) {
      // Points and lines are not drawn, and no exporter writes strips.
      if (primitive.mode != TINYGLTF_MODE_TRIANGLES) continue;
      auto mesh = mesh_of(gltf, primitive, textures);
      if (!mesh) return mesh.error();
      triangles += (*mesh)->triangles.size();
      if (triangles > kMostTriangles) return refused("it has too many triangles");
      model.parts.push_back({number, std::move(*mesh)});
    }
  }
  if (triangles == 0) return refused("it has no triangles");
  return model;
}

std::vector<PlacedMesh> placed(const GltfModel& model, const xr::HeldModel& held) {
  std::vector<glm::dmat4> world_from_node;
  std::vector<bool> visible;
  glm::dmat4 world_from_model = glm::mat4_cast(held.world_from_model.rotation);
  world_from_model[3] = glm::dvec4(held.world_from_model.position_m, 1.0);
  for (const GltfModel::GltfNode& node : model.nodes) {
    glm::dmat4 own = node.parent_from_node;
    bool seen = node.parent < 0 || visible[size_t(node.parent)];
    for (size_t k = 0; k < std::min(held.nodes.size(), held.asset->moving_nodes.size()); ++k) {
      if (held.asset->moving_nodes[k] != node.name) continue;
      own = glm::mat4_cast(held.nodes[k].parent_from_node.rotation);
      own[3] = glm::dvec4(held.nodes[k].parent_from_node.position_m, 1.0);
      seen = seen && held.nodes[k].visible;
    }
    world_from_node.push_back(
        (node.parent < 0 ? world_from_model : world_from_node[size_t(node.parent)]) * own);
    visible.push_back(seen);
  }
  std::vector<PlacedMesh> meshes;
  for (const GltfModel::GltfPart& part : model.parts)
    if (visible[size_t(part.node)])
      meshes.push_back({part.mesh, world_from_node[size_t(part.node)]});
  return meshes;
}

}  // namespace palpate::headset
