// Pixels hidden by the optics are not drawn, and nothing else changes.
#include "module/view/visible_pixels.h"

#include <random>

#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

bool inside(glm::dvec2 p, const glm::vec2* corner[3]) {
  // On the same side of all three edges; the area may have either sign.
  double low = 1e300, high = -1e300;
  for (int e = 0; e < 3; ++e) {
    const glm::dvec2 a = *corner[e], b = *corner[(e + 1) % 3];
    const double side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
    low = std::min(low, side);
    high = std::max(high, side);
  }
  return low >= 0.0 || high <= 0.0;
}

struct Mesh {
  std::vector<glm::vec2> vertices;
  std::vector<uint32_t> indices;
  HiddenTriangles triangles() const { return {vertices, indices}; }
};

/// Whether a pixel's centre is in a triangle, tested for every triangle.
bool covered(const Mesh& mesh, const Eye& eye, PictureSize size, int x, int y) {
  const glm::dvec2 centre(eye.tan_left + (x + 0.5) / size.width * (eye.tan_right - eye.tan_left),
                          eye.tan_up - (y + 0.5) / size.height * (eye.tan_up - eye.tan_down));
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    const glm::vec2* corners[3] = {&mesh.vertices[mesh.indices[i]],
                                   &mesh.vertices[mesh.indices[i + 1]],
                                   &mesh.vertices[mesh.indices[i + 2]]};
    if (inside(centre, corners)) return true;
  }
  return false;
}

/// One flag per pixel: it and all its neighbours are covered.
std::vector<bool> hidden_with_neighbours(const Mesh& mesh, const Eye& eye, PictureSize size) {
  std::vector<bool> alone, all;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) alone.push_back(covered(mesh, eye, size, x, y));
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      bool every = true;
      for (int j = std::max(y - 1, 0); j <= std::min(y + 1, size.height - 1); ++j)
        for (int i = std::max(x - 1, 0); i <= std::min(x + 1, size.width - 1); ++i)
          every = every && alone[size_t(i + size.width * j)];
      all.push_back(every);
    }
  return all;
}

TEST(VisiblePixels, AreThoseWhoseNeighboursAreNotAllInATriangle) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-1.6, 1.6);
    const PictureSize size{int(16 + random() % 130), int(16 + random() % 70)};
    std::array<Mesh, 2> meshes;
    std::array<Eye, 2> eyes;
    for (size_t e = 0; e < 2; ++e) {
      eyes[e].tan_left = e ? -0.7 : -1.1;
      eyes[e].tan_right = e ? 1.1 : 0.7;
      eyes[e].tan_down = -0.9;
      eyes[e].tan_up = 1.0;
      const uint32_t corners = 3 * (1 + uint32_t(random() % 6));
      for (uint32_t k = 0; k < corners; ++k) {
        meshes[e].vertices.emplace_back(place(random), place(random));
        meshes[e].indices.push_back(k);
      }
    }
    const VisiblePixels visible =
        visible_pixels(eyes, std::array{meshes[0].triangles(), meshes[1].triangles()}, size);
    int hidden = 0;
    for (int e = 0; e < 2; ++e) {
      const auto expected = hidden_with_neighbours(meshes[size_t(e)], eyes[size_t(e)], size);
      for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
          const bool is_hidden = expected[size_t(x + size.width * y)];
          hidden += is_hidden;
          ASSERT_EQ(visible.visible(e, x, y), !is_hidden)
              << "seed " << seed << ", eye " << e << ", pixel " << x << " " << y;
        }
    }
    EXPECT_GT(hidden, 0) << "seed " << seed;
  }
}

TEST(VisiblePixels, LeaveNoGapBetweenTrianglesThatShareAnEdge) {
  // A square all around, of two triangles whose common edge passes through pixel centres.
  const Mesh mesh{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}, {0, 1, 2, 0, 2, 3}};
  Eye eye;
  const PictureSize size{64, 64};
  const VisiblePixels visible = visible_pixels(std::array{eye}, std::array{mesh.triangles()}, size);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) EXPECT_FALSE(visible.visible(0, x, y)) << x << " " << y;
}

using SeenPixelsDrawn = ViewTest;

TEST_F(SeenPixelsDrawn, ChangeNothingInsideAndCostNothingOutside) {
  // A multiple neither of the tile nor of a word.
  const PictureSize size{90, 71};
  RendererOptions options{size, 2};
  options.count_samples = true;
  auto drawing = renderer(options);
  const auto heart = beating_heart();
  set(*drawing, {heart});
  ViewScene scene;
  Look look{"fog", {}, {}, 0.0};
  look.points = {{90.0, {0.4, 0.5, 0.9}, 0.001}, {1000.0, {1.0, 0.8, 0.6}, 0.2}};
  scene.volumes = {{heart, {}, {0, 0.4}, look}};
  add_sphere(scene.things, {0.03, 0.02, 0.06}, 0.01, {0.3, 0.7, 0.9});
  std::vector<Eye> eyes(2);
  split_eyes(eye_at({0.0, 0.0, 0.2}, {0.0, 0.0, 0.0}, 0.7, size), 0.06, eyes[0], eyes[1]);
  const auto whole = draw(*drawing, scene, eyes, size);
  const uint64_t all = drawing->statistics().samples_taken;
  ASSERT_GT(all, 10'000u);
  // A slanted border, different for each eye; then its opposite.
  auto one = std::make_shared<VisiblePixels>(), other = std::make_shared<VisiblePixels>();
  *one = visible_pixels(eyes, std::array{HiddenTriangles{}, HiddenTriangles{}}, size);
  *other = *one;
  const auto is_one = [&](int eye, int x, int y) { return 3 * x + (eye ? -1 : 1) * y > 130; };
  const int across = (size.width + 7) / 8, down = (size.height + 7) / 8;
  for (int e = 0; e < 2; ++e)
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        ASSERT_TRUE(one->visible(e, x, y)) << "a pixel is hidden although there is no mask";
        auto& hides = is_one(e, x, y) ? *other : *one;
        hides.tiles[size_t(x / 8 + across * (y / 8 + down * e))] &=
            ~(uint64_t{1} << (x % 8 + 8 * (y % 8)));
      }
  uint64_t sum = 0;
  for (const bool first : {true, false}) {
    const auto& visible = first ? one : other;
    ASSERT_TRUE(drawing->start(scene, eyes, size, visible));
    sum += drawing->statistics().samples_taken;
    for (int e = 0; e < 2; ++e) {
      const auto picture = drawing->read_back(e);
      ASSERT_TRUE(picture);
      for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
          const size_t at = size_t(x + size.width * y);
          const bool shown = is_one(e, x, y) == first;
          ASSERT_EQ(picture->colours[at], shown ? whole[size_t(e)].colours[at] : 0u)
              << "eye " << e << ", pixel " << x << " " << y;
          ASSERT_EQ(picture->depths[at], shown ? whole[size_t(e)].depths[at] : 0.0F);
        }
    }
  }
  EXPECT_EQ(sum, all) << "each ray is cast in one of the two pictures";
  // Without it the picture is as before.
  EXPECT_EQ(draw(*drawing, scene, eyes, size)[1].colours, whole[1].colours);
  ASSERT_FALSE(drawing->start(scene, eyes, {80, 71}, one))
      << "a mask for another size was accepted";
}

}  // namespace
}  // namespace palpate::test
