// Models of controllers: what is read of a glTF, where its parts come to lie, and broken files.
#include "integration/headset/gltf_model.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/xr/made_glb.h"

namespace palpate::headset {
namespace {

using test::glb_of;

GltfModel read(const std::vector<uint8_t>& glb) {
  Result<GltfModel> model = read_gltf(glb);
  EXPECT_TRUE(model) << (model ? "" : model.error().message);
  return model ? std::move(*model) : GltfModel{};
}

std::string refusal(const std::string& json, const std::vector<uint8_t>& bytes = {}) {
  const Result<GltfModel> model = read_gltf(glb_of(json, bytes));
  return model ? "" : model.error().message;
}

/// The corners of the box around a mesh, where it is placed.
std::pair<glm::dvec3, glm::dvec3> box_of(const PlacedMesh& placed) {
  glm::dvec3 low(1e9), high(-1e9);
  for (const Mesh::Vertex& vertex : placed.mesh->vertices) {
    const glm::dvec3 at(placed.world_from_mesh * glm::dvec4(glm::dvec3(vertex.at), 1.0));
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  return {low, high};
}

xr::HeldModel held_at(glm::dvec3 place) {
  xr::HeldModel held;
  auto asset = std::make_shared<xr::ModelAsset>();
  asset->moving_nodes = {"nobody has it", "trigger"};
  held.asset = asset;
  held.world_from_model.position_m = place;
  return held;
}

TEST(GltfModelTest, PartsLieWhereTheirNodesAre) {
  const GltfModel model = read(test::made_controller());
  ASSERT_EQ(model.parts.size(), 2u);
  xr::HeldModel held = held_at({1.0, 2.0, 3.0});
  std::vector<PlacedMesh> meshes = placed(model, held);
  ASSERT_EQ(meshes.size(), 2u);
  // The trigger is read first or last: it is the one of 10 mm.
  const auto size = [](const PlacedMesh& mesh) { return box_of(mesh).second - box_of(mesh).first; };
  if (size(meshes[0]).x < 0.02) std::swap(meshes[0], meshes[1]);
  EXPECT_LT(glm::distance(size(meshes[0]), glm::dvec3(0.03, 0.04, 0.1)), 1e-6);
  EXPECT_LT(glm::distance(box_of(meshes[0]).first, glm::dvec3(0.985, 1.98, 2.95)), 1e-6);
  EXPECT_LT(glm::distance(box_of(meshes[1]).first, glm::dvec3(0.995, 1.955, 2.995)), 1e-6);
  EXPECT_NEAR(meshes[0].mesh->colour.r, 0.9, 1e-6);
  EXPECT_NEAR(meshes[1].mesh->colour.g, 0.9, 1e-6);
  EXPECT_EQ(meshes[0].mesh->triangles.size(), 12u);
}

TEST(GltfModelTest, NodesAreMovedAndHiddenAsTheRuntimeSays) {
  GltfModel model = read(test::made_controller());
  // The runtime's pose takes the place of all that the asset has, its scale too.
  for (GltfModel::GltfNode& node : model.nodes)
    if (node.name == "trigger") node.parent_from_node[0] *= 2.0;
  xr::HeldModel held = held_at({0.0, 0.0, 0.0});
  held.world_from_model.rotation = glm::angleAxis(std::acos(0.0), glm::dvec3(0, 0, 1));
  held.nodes.resize(2);
  // Its place in the grip instead of the asset's, with all that hangs on it; then turned with all.
  held.nodes[1].parent_from_node.position_m = {0.0, -0.03, 0.0};
  std::vector<PlacedMesh> meshes = placed(model, held);
  ASSERT_EQ(meshes.size(), 2u);
  if (meshes[0].mesh->colour.g > 0.5F) std::swap(meshes[0], meshes[1]);
  const auto [low, high] = box_of(meshes[1]);
  EXPECT_LT(glm::distance(0.5 * (low + high), glm::dvec3(0.03, 0.0, 0.0)), 1e-6);
  EXPECT_LT(glm::distance(high - low, glm::dvec3(0.01)), 1e-6);
  held.nodes[1].visible = false;
  meshes = placed(model, held);
  ASSERT_EQ(meshes.size(), 1u);
  EXPECT_GT(meshes[0].mesh->colour.r, 0.5F);
  held.nodes[0].visible = false;  // of a node that it does not have
  held.nodes[1].visible = true;
  EXPECT_EQ(placed(model, held).size(), 2u);
}

/// Three corners as floats: 36 bytes; then texture coordinates of bytes: 6; two bytes of padding.
std::vector<uint8_t> three_corners() {
  const float at[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::vector<uint8_t> bytes(44);
  std::memcpy(bytes.data(), at, sizeof at);
  const uint8_t coordinates[6] = {0, 0, 255, 0, 0, 51};
  std::memcpy(bytes.data() + 36, coordinates, sizeof coordinates);
  return bytes;
}

/// A triangle; `more`: further members of the primitive, `rest`: further members of the file.
std::string triangle(const std::string& more = "", const std::string& rest = "",
                     const std::string& accessor = R"("count": 3)") {
  return R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1})" +
         more + R"(}]}], "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", )" +
         accessor + R"(}, {"bufferView": 1, "componentType": 5121, "count": 3, "type": "VEC2",
    "normalized": true}], "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0,
    "byteOffset": 36, "byteLength": 6}], "buffers": [{"byteLength": 44}])" +
         rest + "}";
}

TEST(GltfModelTest, WithoutIndicesCornersFollowEachOtherAndBytesAreShares) {
  const GltfModel model = read(glb_of(triangle(), three_corners()));
  ASSERT_EQ(model.parts.size(), 1u);
  const Mesh& mesh = *model.parts[0].mesh;
  ASSERT_EQ(mesh.triangles.size(), 1u);
  EXPECT_EQ(mesh.triangles[0], glm::uvec3(0, 1, 2));
  EXPECT_FLOAT_EQ(mesh.vertices[1].texture.x, 1.0F);
  EXPECT_FLOAT_EQ(mesh.vertices[2].texture.y, 0.2F);
  EXPECT_EQ(mesh.vertices[0].normal, glm::vec3(0.0F));
  EXPECT_EQ(mesh.colour, glm::vec3(1.0F));
  EXPECT_EQ(mesh.texture, nullptr);
}

TEST(GltfModelTest, ImagesInsideAreReadAndThoseBesideItAreNot) {
  // A PNG of 2 x 1 pixels, red and blue.
  const std::string png =
      "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAIAAAB7QOjdAAAADUlEQVR4nGP4zwAE/wEHAAH/4iOe"
      "WQAAAABJRU5ErkJggg==";
  const auto textured = [&](const std::string& uri) {
    return read(glb_of(triangle(R"(, "material": 0)",
                                R"(, "materials": [{"pbrMetallicRoughness": {"baseColorTexture":
      {"index": 0}}}], "textures": [{"source": 0}], "images": [{"uri": ")" +
                                    uri + R"("}])"),
                       three_corners()));
  };
  const GltfModel inside = textured("data:image/png;base64," + png);
  ASSERT_EQ(inside.parts.size(), 1u);
  ASSERT_NE(inside.parts[0].mesh->texture, nullptr);
  const MeshTexture& texture = *inside.parts[0].mesh->texture;
  EXPECT_EQ(texture.width, 2);
  EXPECT_EQ(texture.height, 1);
  ASSERT_EQ(texture.texels.size(), 3u);
  EXPECT_EQ(texture.texels[0], 0xff0000ffU);
  EXPECT_EQ(texture.texels[1], 0xffff0000U);
  EXPECT_EQ(texture.levels, 2);
  // An image that can not be read leaves the part without it.
  EXPECT_EQ(textured("data:image/png;base64,bm8gaW1hZ2U=").parts.at(0).mesh->texture, nullptr);
  // Nor is a file read, though it is there.
  const auto file = std::filesystem::temp_directory_path() / "palpate_gltf_test.png";
  ASSERT_TRUE(std::filesystem::exists(file) || std::ofstream(file).put('x'));
  EXPECT_EQ(textured(file.string()).parts.at(0).mesh->texture, nullptr);
  std::filesystem::remove(file);
}

TEST(GltfModelTest, BrokenModelsAreRefusedInASentence) {
  EXPECT_EQ(read_gltf({}).error().message, "The model can not be read: it is no binary glTF 2.0.");
  EXPECT_EQ(refusal("{"), "The model can not be read: it is no binary glTF 2.0.");
  EXPECT_EQ(refusal(R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": []}]})"),
            "The model can not be read: it has no triangles.");
  EXPECT_EQ(refusal(triangle("", R"(, "extensionsRequired": ["KHR_draco_mesh_compression"])"),
                    three_corners()),
            "The model can not be read: it needs the extension KHR_draco_mesh_compression.");
  EXPECT_EQ(refusal(triangle("", "", R"("count": 4)"), three_corners()),
            "The model can not be read: a part of it has no places of corners.");
  EXPECT_EQ(refusal(triangle("", "", R"("count": 3, "byteOffset": 4294967292)"), three_corners()),
            "The model can not be read: a part of it has no places of corners.");
  EXPECT_EQ(refusal(triangle(R"(, "indices": 0)"), three_corners()),
            "The model can not be read: a part of it has no list of triangles.");
  std::vector<uint8_t> infinite = three_corners();
  const float value = std::numeric_limits<float>::infinity();
  std::memcpy(infinite.data() + 4, &value, 4);
  EXPECT_EQ(refusal(triangle(), infinite),
            "The model can not be read: it has numbers that are not finite.");
  EXPECT_EQ(refusal(R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
                        "nodes": [{"children": [1]}, {"children": [0]}]})"),
            "The model can not be read: its nodes are not a tree.");
}

TEST(GltfModelTest, AnyWrongByteGivesAModelOrASentence) {
  const std::vector<uint8_t> whole = test::made_controller();
  std::mt19937 random(3);
  int refused = 0;
  for (int k = 0; k < 3000; ++k) {
    std::vector<uint8_t> glb = whole;
    for (int n = 0; n < 1 + k % 3; ++n) glb[random() % glb.size()] = uint8_t(random());
    if (k % 5 == 0) glb.resize(random() % glb.size());
    const Result<GltfModel> model = read_gltf(glb);
    if (!model) {
      EXPECT_EQ(model.error().message.rfind("The model can not be read: ", 0), 0u);
      ++refused;
      continue;
    }
    for (const GltfModel::GltfPart& part : model->parts)
      for (const glm::uvec3& corner : part.mesh->triangles)
        ASSERT_LT(std::max({corner.x, corner.y, corner.z}), part.mesh->vertices.size());
  }
  EXPECT_GT(refused, 500);
  EXPECT_LT(refused, 2900);
}

}  // namespace
}  // namespace palpate::headset
