// Triangles beside volumes: against a search of all of them, closed surfaces, textures, the order
// in depth.
#include <random>

#include "module/view/mesh.h"
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

constexpr PictureSize kMeshSize{160, 120};
constexpr double kMeshNear_m = RendererOptions{}.near_m;

class MeshTest : public ViewTest {
 protected:
  void SetUp() override {
    ViewTest::SetUp();
    if (IsSkipped()) return;
    view_ = renderer({kMeshSize, 2});
    set(*view_, {speck_});
    scene_.volumes = {{speck_, {}, {}, step_look(2.0)}};
  }
  Picture draw_one() { return draw(*view_, scene_, {eye_}, kMeshSize)[0]; }
  double depth_at(const Picture& picture, int x, int y) {
    return kMeshNear_m / double(picture.depths[size_t(y * kMeshSize.width + x)]);
  }

  Eye eye_ = eye_at({0.0, 0.0, 0.25}, {0.0, 0.0, 0.0}, 0.4, kMeshSize);
  /// Nothing of it is seen with the look above.
  std::shared_ptr<const MovingVolume> speck_ = still_volume(8, 1.0, [](glm::dvec3) { return 0.0; });
  std::unique_ptr<VolumeRenderer> view_;
  ViewScene scene_;
};

/// The nearest hit of a ray from `from` along `way` with the mesh, depth and triangle; `edge`: how
/// far it is from any edge there, as a share of the triangle.
struct Hit {
  double depth = 1e9, edge = 1.0;
  glm::dvec3 normal{0.0};
};
void meet(const PlacedMesh& placed, glm::dvec3 from, glm::dvec3 way, Hit& hit,
          double& nearest_edge) {
  for (const glm::uvec3& triangle : placed.mesh->triangles) {
    glm::dvec3 p[3];
    for (int c = 0; c < 3; ++c)
      p[c] = glm::dvec3(placed.world_from_mesh *
                        glm::dvec4(glm::dvec3(placed.mesh->vertices[triangle[c]].at), 1.0));
    // Moller and Trumbore.
    const glm::dvec3 u = p[1] - p[0], v = p[2] - p[0], h = glm::cross(way, v), s = from - p[0];
    const double a = glm::dot(u, h);
    if (std::abs(a) < 1e-18) continue;
    const glm::dvec3 q = glm::cross(s, u);
    const double wu = glm::dot(s, h) / a, wv = glm::dot(way, q) / a, t = glm::dot(v, q) / a;
    const double inside = std::min({wu, wv, 1.0 - wu - wv});
    if (t > 0.0) nearest_edge = std::min(nearest_edge, std::abs(inside));
    if (inside < 0.0 || t < 0.0 || t >= hit.depth) continue;
    hit = {t, inside, glm::normalize(glm::cross(u, v))};
  }
}

TEST_F(MeshTest, TrianglesAreMetWhereASearchOfAllFindsThem) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> at(-0.05F, 0.05F), size(-0.03F, 0.03F);
  auto mesh = std::make_shared<Mesh>();
  for (uint32_t k = 0; k < 150; ++k) {
    const glm::vec3 corner(at(random), at(random), at(random));
    for (int c = 0; c < 3; ++c)
      mesh->vertices.push_back({corner + glm::vec3(size(random), size(random), size(random))});
    mesh->triangles.emplace_back(3 * k, 3 * k + 1, 3 * k + 2);
  }
  mesh->colour = {0.5F, 0.25F, 0.0F};
  // Rotated, stretched, and twice at once.
  glm::dmat4 place(1.0);
  place[0] = {0.6, 0.8, 0.0, 0.0};
  place[1] = {-1.2, 0.9, 0.0, 0.0};
  place[3] = {0.002, 0.001, 0.01, 1.0};
  scene_.meshes = {{mesh, place}, {mesh, glm::dmat4(1.0)}};
  const std::vector<Eye> eyes{eye_, eye_at({0.03, 0.01, 0.2}, {0.0, 0.0, 0.0}, 0.5, kMeshSize)};
  const std::vector<Picture> pictures = draw(*view_, scene_, eyes, kMeshSize);
  int met = 0;
  for (size_t e = 0; e < eyes.size(); ++e)
    for (int y = 0; y < kMeshSize.height; ++y)
      for (int x = 0; x < kMeshSize.width; ++x) {
        const glm::dvec3 way = ray_of(eyes[e], kMeshSize, x, y);
        Hit hit;
        double nearest_edge = 1.0;
        for (const PlacedMesh& placed : scene_.meshes)
          meet(placed, eyes[e].position_m, way, hit, nearest_edge);
        // On an edge fp32 decides.
        if (nearest_edge < 1e-3) continue;
        if (hit.depth > 1e8) {
          ASSERT_EQ(pictures[e].depths[size_t(y * kMeshSize.width + x)], 0.0F) << x << ", " << y;
          continue;
        }
        ++met;
        ASSERT_NEAR(depth_at(pictures[e], x, y), hit.depth, 2e-5 * hit.depth) << x << ", " << y;
        ASSERT_EQ(channel(pictures[e], x, y, 3), 255);
        // Red of 0.5 with the light on it: ambient 0.30, the rest by the formula of lit_thing.glsl.
        glm::dvec3 n = hit.normal;
        if (glm::dot(n, way) > 0.0) n = -n;
        const glm::dvec3 to_eye = -glm::normalize(way);
        const glm::dvec3 light = eyes[0].orientation * glm::normalize(scene_.light);
        const double diffuse = std::max(0.35 + 0.65 * glm::dot(n, light), 0.0);
        const double shine =
            std::pow(std::max(glm::dot(n, glm::normalize(light + to_eye)), 0.0), 32.0);
        const double lit =
            0.5 * (0.30 + 0.55 * diffuse + 0.25 * glm::dot(n, to_eye)) + 0.22 * shine;
        const double red = channel(pictures[e], x, y, 0) / 255.0;
        ASSERT_NEAR(linear_from_srgb(red), std::min(lit, 1.0), 0.012) << x << ", " << y;
      }
  EXPECT_GT(met, 8000);
}

/// A ball of n x 2n quads.
std::shared_ptr<Mesh> ball_mesh(double radius_m, int n) {
  auto mesh = std::make_shared<Mesh>();
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= 2 * n; ++i) {
      const double a = std::acos(-1.0) * j / n, b = std::acos(-1.0) * i / n;
      const glm::dvec3 way(std::sin(a) * std::cos(b), std::cos(a), std::sin(a) * std::sin(b));
      mesh->vertices.push_back({glm::vec3(radius_m * way), glm::vec3(way)});
    }
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < 2 * n; ++i) {
      const auto v = uint32_t(j * (2 * n + 1) + i), down = uint32_t(2 * n + 1);
      mesh->triangles.emplace_back(v, v + 1, v + down);
      mesh->triangles.emplace_back(v + 1, v + down + 1, v + down);
    }
  return mesh;
}

TEST_F(MeshTest, AClosedMeshHasNoHolesAndLooksLikeTheBodyItStandsFor) {
  const auto mesh = ball_mesh(0.03, 64);
  mesh->colour = glm::vec3(float(linear_from_srgb(0.7)));
  scene_.meshes = {{mesh, glm::dmat4(1.0)}};
  const Picture meshed = draw_one();
  scene_.meshes.clear();
  add_sphere(scene_.things, {0.0, 0.0, 0.0}, 0.03, glm::dvec3(0.7));
  const Picture round = draw_one();
  int inside = 0;
  for (int y = 0; y < kMeshSize.height; ++y)
    for (int x = 0; x < kMeshSize.width; ++x) {
      const glm::dvec3 way = ray_of(eye_, kMeshSize, x, y), o = eye_.position_m;
      const double b = glm::dot(way, o);
      const double under = b * b - glm::dot(way, way) * (glm::dot(o, o) - 0.03 * 0.03);
      if (under < 0.05 * glm::dot(way, way) * 0.03 * 0.03) continue;
      ++inside;
      ASSERT_NEAR(depth_at(meshed, x, y), depth_at(round, x, y), 0.003) << x << ", " << y;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(channel(meshed, x, y, c), channel(round, x, y, c), 4) << x << ", " << y;
    }
  EXPECT_GT(inside, 2000);
}

/// A square of 0.06 m around the middle, towards +z, with the texture upright.
std::shared_ptr<Mesh> square(std::shared_ptr<const MeshTexture> texture) {
  auto mesh = std::make_shared<Mesh>();
  for (const glm::vec2 at : {glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(1, 1), glm::vec2(0, 1)})
    mesh->vertices.push_back(
        {glm::vec3(0.06F * (at.x - 0.5F), 0.06F * (0.5F - at.y), 0.0F), {0.0F, 0.0F, 1.0F}, at});
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh->texture = std::move(texture);
  return mesh;
}

TEST_F(MeshTest, ATextureStandsUprightAndIsItsMeanFromFarAway) {
  // Red, green / blue, white; each 4 x 4 texels.
  std::vector<uint32_t> pixels(64);
  for (size_t k = 0; k < 64; ++k) {
    const bool right = k % 8 >= 4, low = k / 8 >= 4;
    pixels[k] = low ? (right ? 0xffffffffU : 0xffff0000U) : (right ? 0xff00ff00U : 0xff0000ffU);
  }
  scene_.meshes = {{square(mesh_texture(8, 8, pixels)), glm::dmat4(1.0)}};
  const Picture close = draw_one();
  const auto seen = [&](const Picture& picture, double x_m, double y_m) {
    const int x = int((0.5 + x_m / (0.25 * (eye_.tan_right - eye_.tan_left))) * kMeshSize.width);
    const int y = int((0.5 - y_m / (0.25 * (eye_.tan_up - eye_.tan_down))) * kMeshSize.height);
    return glm::ivec3(channel(picture, x, y, 0), channel(picture, x, y, 1),
                      channel(picture, x, y, 2));
  };
  const glm::ivec3 red = seen(close, -0.02, 0.02), green = seen(close, 0.02, 0.02),
                   blue = seen(close, -0.02, -0.02), white = seen(close, 0.02, -0.02);
  EXPECT_GT(red.x, red.y + 100);
  EXPECT_GT(green.y, green.x + 100);
  EXPECT_GT(blue.z, blue.y + 100);
  EXPECT_GT(std::min({white.x, white.y, white.z}), 200);
  // A hundred copies of it side by side, each less than a pixel wide: red 1/2, green 1/2, blue 1/2.
  const auto many = square(mesh_texture(8, 8, pixels));
  for (Mesh::Vertex& vertex : many->vertices) vertex.texture *= 100.0F;
  scene_.meshes = {{many, glm::dmat4(1.0)}};
  const Picture far = draw_one();
  const auto plain = square(nullptr);
  plain->colour = glm::vec3(0.5F);
  scene_.meshes = {{plain, glm::dmat4(1.0)}};
  const Picture mean = draw_one();
  for (const glm::dvec2 at :
       {glm::dvec2(-0.02, 0.01), glm::dvec2(0.011, 0.017), glm::dvec2(0.02, -0.02)})
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen(far, at.x, at.y)[c], seen(mean, at.x, at.y)[c], 3);
}

TEST(MeshTextureTest, LevelsHalveToOneTexelOfTheMeanLight) {
  const auto texture = mesh_texture(
      5, 2,
      std::vector<uint32_t>{0xff0000ffU, 0xff000000U, 0xffffffffU, 0xffffffffU, 0xff00ff00U,
                            0xff0000ffU, 0xff000000U, 0xffffffffU, 0xffffffffU, 0xff00ff00U});
  // 5 x 2, 2 x 1, 1 x 1; an odd edge's last texels are left out, as from 5 to 2.
  EXPECT_EQ(texture->levels, 3);
  ASSERT_EQ(texture->texels.size(), 10u + 2u + 1u);
  EXPECT_EQ(texture->texels[10], 0xff0000bcU);  // half the light of 255 is 188
  EXPECT_EQ(texture->texels[11], 0xffffffffU);
}

TEST_F(MeshTest, MeshesThingsAndVolumesHideEachOtherByTheirDepth) {
  const auto ball = still_volume(
      64, 1.0, [](glm::dvec3 x) { return std::clamp(12.5 - glm::length(x), 0.0, 1.0); });
  set(*view_, {ball});
  Look look{"ball", {}, {0.6, 0.5, 0.0}, 0.0};
  look.points = {{0.45, {0.9, 0.1, 0.1}, 0.0}, {0.55, {0.9, 0.1, 0.1}, 0.999}};
  scene_.volumes = {{ball, {}, {}, look}};
  const auto plane = square(nullptr);
  plane->colour = {0.0F, 0.8F, 0.0F};
  const auto strongest = [&](const Picture& picture, int x, int y) {
    const int r = channel(picture, x, y, 0), g = channel(picture, x, y, 1),
              b = channel(picture, x, y, 2);
    return r > g && r > b ? 'r' : g > b ? 'g' : 'b';
  };
  const auto at = [](double z_m) {
    glm::dmat4 place(1.0);
    place[3] = {0.0, 0.0, z_m, 1.0};
    return place;
  };
  // Through the middle of the ball, which stands out of it; a blue rod in front of all and one in
  // between.
  scene_.meshes = {{plane, at(0.0)}};
  add_sphere(scene_.things, {0.0, 0.0, 0.02}, 0.002, {0.1, 0.1, 0.9});
  add_sphere(scene_.things, {0.02, 0.0, -0.01}, 0.004, {0.1, 0.1, 0.9});
  Picture picture = draw_one();
  EXPECT_EQ(strongest(picture, 80, 60), 'b');
  EXPECT_EQ(strongest(picture, 80, 50), 'r');
  EXPECT_EQ(strongest(picture, 111, 60), 'g');
  EXPECT_EQ(strongest(picture, 80, 30), 'g');
  // In front of all.
  scene_.meshes = {{plane, at(0.05)}};
  picture = draw_one();
  for (const glm::ivec2 p : {glm::ivec2(80, 60), glm::ivec2(80, 50), glm::ivec2(111, 60)})
    EXPECT_EQ(strongest(picture, p.x, p.y), 'g');
  // Without, all is as it was, and the ball hides the second sphere no more than before.
  scene_.meshes.clear();
  picture = draw_one();
  EXPECT_EQ(strongest(picture, 111, 60), 'b');
  EXPECT_EQ(strongest(picture, 80, 50), 'r');
}

TEST_F(MeshTest, TrianglesTooNearTheEyeAreNotDrawn) {
  // One reaches to half the nearest depth; most of it lies beyond.
  auto mesh = std::make_shared<Mesh>();
  mesh->vertices = {{{-0.1F, 0.0F, 0.0F}}, {{0.1F, 0.0F, 0.0F}}, {{0.0F, 0.004F, 0.24F}}};
  mesh->triangles = {{0, 1, 2}};
  scene_.meshes = {{mesh, glm::dmat4(1.0)}};
  const Picture picture = draw_one();
  for (const float depth : picture.depths) ASSERT_EQ(depth, 0.0F);
}

TEST_F(MeshTest, AMissingMeshIsRefused) {
  scene_.meshes = {{nullptr, glm::dmat4(1.0)}};
  const Status started = view_->start(scene_, {{eye_}}, kMeshSize);
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().message, "This scene can not be drawn: one of its meshes is missing.");
}

}  // namespace
}  // namespace palpate::test
