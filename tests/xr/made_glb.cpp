#include "tests/xr/made_glb.h"

#include <cstring>

namespace palpate::test {
namespace {

void append(std::vector<uint8_t>& to, const void* from, size_t bytes) {
  const auto* first = static_cast<const uint8_t*>(from);
  to.insert(to.end(), first, first + bytes);
}

void append_word(std::vector<uint8_t>& to, uint32_t word) {
  append(to, &word, 4);
}

void append_chunk(std::vector<uint8_t>& to, uint32_t type, std::vector<uint8_t> content,
                  uint8_t padding) {
  while (content.size() % 4) content.push_back(padding);
  append_word(to, uint32_t(content.size()));
  append_word(to, type);
  append(to, content.data(), content.size());
}

}  // namespace

std::vector<uint8_t> glb_of(const std::string& json, const std::vector<uint8_t>& bytes) {
  std::vector<uint8_t> chunks;
  append_chunk(chunks, 0x4e4f534aU, {json.begin(), json.end()}, ' ');
  if (!bytes.empty()) append_chunk(chunks, 0x004e4942U, bytes, 0);
  std::vector<uint8_t> glb;
  append_word(glb, 0x46546c67U);
  append_word(glb, 2);
  append_word(glb, uint32_t(12 + chunks.size()));
  append(glb, chunks.data(), chunks.size());
  return glb;
}

std::vector<uint8_t> made_controller() {
  // A cube from -1/2 to 1/2, which both nodes share: eight corners, twelve triangles.
  std::vector<uint8_t> bytes;
  for (int corner = 0; corner < 8; ++corner) {
    const float at[3] = {corner & 1 ? 0.5F : -0.5F, corner & 2 ? 0.5F : -0.5F,
                         corner & 4 ? 0.5F : -0.5F};
    append(bytes, at, sizeof at);
  }
  const uint16_t triangles[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                  2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  append(bytes, triangles, sizeof triangles);
  const std::string json = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"name": "grip", "children": [1, 2]},
              {"name": "shell", "mesh": 0, "scale": [0.03, 0.04, 0.1]},
              {"name": "trigger", "translation": [0, -0.04, 0], "children": [3]},
              {"mesh": 1, "scale": [0.01, 0.01, 0.01]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]},
               {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 1}]}],
    "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.02, 0.02, 1]}},
                  {"pbrMetallicRoughness": {"baseColorFactor": [0.02, 0.9, 0.02, 1]}}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3",
                   "min": [-0.5, -0.5, -0.5], "max": [0.5, 0.5, 0.5]},
                  {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 96},
                    {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
    "buffers": [{"byteLength": 168}]})";
  return glb_of(json, bytes);
}

}  // namespace palpate::test
