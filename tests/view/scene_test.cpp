// The order in depth, and left and right.
#include "module/view/letters.h"
#include "tests/view/picture_file.h"
#include "tests/view/slow_rays.h"
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

constexpr PictureSize kSceneSize{160, 120};

/// A ball of 12 mm radius around `centre` (mm, volume space), 1 inside and 0 outside.
std::shared_ptr<const MovingVolume> ball(glm::dvec3 centre_mm, double radius_mm = 12.0) {
  return still_volume(64, 1.0, [=](glm::dvec3 x) {
    return std::clamp(radius_mm - glm::length(x - centre_mm) + 0.5, 0.0, 1.0);
  });
}

Look ball_look(glm::dvec3 colour) {
  Look look{"ball", {}, {0.6, 0.5, 0.0}, 0.0};
  look.points = {{0.45, colour, 0.0}, {0.55, colour, 0.999}};
  return look;
}

/// The dominant colour at a place of the world: 'r', 'g', 'b', or '.' for the background.
char seen_at(const Picture& picture, const Eye& eye, glm::dvec3 world) {
  const glm::dvec3 at = glm::conjugate(eye.orientation) * (world - eye.position_m);
  const int x = int((at.x / -at.z - eye.tan_left) / (eye.tan_right - eye.tan_left) * picture.width);
  const int y = int((eye.tan_up - at.y / -at.z) / (eye.tan_up - eye.tan_down) * picture.height);
  if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) return '?';
  const int r = channel(picture, x, y, 0), g = channel(picture, x, y, 1),
            b = channel(picture, x, y, 2);
  if (channel(picture, x, y, 3) < 128) return '.';
  return r > g && r > b ? 'r' : g > b ? 'g' : 'b';
}

constexpr glm::dvec3 kRed(0.9, 0.1, 0.1), kGreen(0.1, 0.8, 0.1), kBlue(0.1, 0.1, 0.9);

class SceneTest : public ViewTest {
 protected:
  const Eye eye_ = eye_at({0.0, 0.0, 0.25}, {0.0, 0.0, 0.0}, 0.4, kSceneSize);
  Picture draw_one(VolumeRenderer& view, const ViewScene& scene) {
    return draw(view, scene, {eye_}, kSceneSize)[0];
  }
};

TEST_F(SceneTest, OtherEyesContinueTheBackgroundOfTheFirst) {
  // Nothing of the ball is in the column that is looked at.
  const auto red = ball({0, 0, 0});
  auto view = renderer({kSceneSize, 4});
  set(*view, {red});
  ViewScene scene;
  scene.volumes = {{red, {}, {}, ball_look(kRed)}};
  scene.background_top = {0.9, 0.1, 0.2};
  scene.background_bottom = {0.1, 0.8, 0.2};
  std::vector<Eye> eyes(4, eye_);
  eyes[1].tan_up = 0.5 * eye_.tan_up;
  eyes[1].tan_down = 0.25 * eye_.tan_down;
  eyes[2].tan_up = 2.0 * eye_.tan_up;
  eyes[3].tan_down = 0.0;
  const std::vector<Picture> pictures = draw(*view, scene, eyes, kSceneSize);
  ASSERT_EQ(pictures.size(), 4u);
  for (size_t e = 0; e < 4; ++e)
    for (int y = 0; y < kSceneSize.height; ++y) {
      const double tangent =
          eyes[e].tan_up - (eyes[e].tan_up - eyes[e].tan_down) * (y + 0.5) / kSceneSize.height;
      const double row =
          (eye_.tan_up - tangent) / (eye_.tan_up - eye_.tan_down) * kSceneSize.height - 0.5;
      // Between two rows of the first eye's picture, or beyond its edges, or in half a row there.
      const int above = int(std::floor(row));
      for (int c = 0; c < 3; ++c) {
        const auto first_eye = [&](int y_there) {
          const double end = y_there < 0 ? scene.background_top[c] : scene.background_bottom[c];
          return y_there < 0 || y_there >= kSceneSize.height ? int(std::lround(255.0 * end))
                                                             : channel(pictures[0], 5, y_there, c);
        };
        const int a = first_eye(above), b = first_eye(above + 1);
        const int found = channel(pictures[e], 5, y, c);
        ASSERT_GE(found, std::min(a, b) - 1) << "eye " << e << ", row " << y;
        ASSERT_LE(found, std::max(a, b) + 1) << "eye " << e << ", row " << y;
      }
    }
}

TEST_F(SceneTest, TwoVolumesHideEachOtherByTheirDepth) {
  const auto red = ball({0, 0, 0}), green = ball({0, 0, 0}, 12.5);
  auto view = renderer({kSceneSize, 1});
  set(*view, {red, green});
  ViewScene scene;
  Transform near, far;
  near.translation_m = {0.0, 0.0, 0.03};
  far.translation_m = {0.004, 0.0, -0.03};
  scene.volumes = {{red, near, {}, ball_look(kRed)}, {green, far, {}, ball_look(kGreen)}};
  EXPECT_EQ(seen_at(draw_one(*view, scene), eye_, {0, 0, 0.03}), 'r');
  std::swap(scene.volumes[0].world_from_volume, scene.volumes[1].world_from_volume);
  EXPECT_EQ(seen_at(draw_one(*view, scene), eye_, {0, 0, 0.03}), 'g');
  // Balls that intersect: each is visible where it is in front.
  Transform left, right;
  left.translation_m = {-0.006, 0.0, 0.0};
  right.translation_m = {0.006, 0.0, 0.0};
  scene.volumes = {{red, left, {}, ball_look(kRed)}, {green, right, {}, ball_look(kGreen)}};
  const Picture both = draw_one(*view, scene);
  EXPECT_EQ(seen_at(both, eye_, {-0.008, 0.0, 0.012}), 'r');
  EXPECT_EQ(seen_at(both, eye_, {0.008, 0.0, 0.012}), 'g');
}

TEST_F(SceneTest, ThingsAndVolumesHideEachOtherByTheirDepth) {
  const auto red = ball({0, 0, 0});
  auto view = renderer({kSceneSize, 1});
  set(*view, {red});
  ViewScene scene;
  scene.volumes = {{red, {}, {}, ball_look(kRed)}};
  // A rod through the ball from left to right, and one in front of it.
  scene.things.push_back({{-0.03, 0.0, 0.0}, {0.03, 0.0, 0.0}, 0.003, 0.003, kBlue});
  scene.things.push_back({{-0.03, 0.006, 0.016}, {0.03, 0.006, 0.016}, 0.002, 0.002, kGreen});
  const Picture picture = draw_one(*view, scene);
  EXPECT_EQ(seen_at(picture, eye_, {0.0, 0.0, 0.012}), 'r');
  EXPECT_EQ(seen_at(picture, eye_, {0.02, 0.0, 0.0}), 'b');
  EXPECT_EQ(seen_at(picture, eye_, {0.0, 0.006, 0.016}), 'g');
  EXPECT_EQ(seen_at(picture, eye_, {0.0, 0.02, 0.0}), '.');
}

TEST_F(SceneTest, ThingsAreMetWhereTheirFormulaSays) {
  const auto red = ball({0, 0, 0}, 1.0);
  RendererOptions options{kSceneSize, 1};
  auto view = renderer(options);
  set(*view, {red});
  ViewScene scene;
  scene.volumes = {{red, {}, {}, ball_look(kRed)}};
  // A sphere, with a known depth at every pixel well inside its rim.
  const glm::dvec3 centre(0.01, -0.005, 0.02);
  constexpr double kRadius = 0.015;
  add_sphere(scene.things, centre, kRadius, kBlue);
  const Picture picture = draw_one(*view, scene);
  int met = 0;
  for (int y = 0; y < kSceneSize.height; ++y)
    for (int x = 0; x < kSceneSize.width; ++x) {
      const glm::dvec3 way = ray_of(eye_, kSceneSize, x, y), o = eye_.position_m - centre;
      const double a = glm::dot(way, way), b = glm::dot(way, o);
      const double under = b * b - a * (glm::dot(o, o) - kRadius * kRadius);
      if (under < 0.05 * a * kRadius * kRadius) continue;
      ++met;
      const double depth =
          options.near_m / double(picture.depths[size_t(y * kSceneSize.width + x)]);
      // Shapes are drawn half a pixel too thick: here a pixel is 0.8 mm wide, and the slope at the
      // rim is at least 0.22.
      ASSERT_NEAR(depth, (-b - std::sqrt(under)) / a, 0.5 * 0.0009 / 0.2) << x << ", " << y;
    }
  EXPECT_GT(met, 500);
}

TEST_F(SceneTest, ClipPlanesCutVolumesAndNotThings) {
  const auto red = ball({0, 0, 0});
  auto view = renderer({kSceneSize, 1});
  set(*view, {red});
  ViewScene scene;
  scene.volumes = {{red, {}, {}, ball_look(kRed)}};
  add_sphere(scene.things, {0.02, 0.0, 0.0}, 0.003, kBlue);
  // Keeps x < 0.
  scene.clips = {{{-1.0, 0.0, 0.0}, 0.0}};
  Picture picture = draw_one(*view, scene);
  EXPECT_EQ(seen_at(picture, eye_, {-0.006, 0.0, 0.01}), 'r');
  EXPECT_EQ(seen_at(picture, eye_, {0.006, 0.0, 0.01}), '.');
  EXPECT_EQ(seen_at(picture, eye_, {0.02, 0.0, 0.003}), 'b');
  scene.clips = clip_box({}, {-0.005, -0.005, -0.1}, {0.005, 0.005, 0.1});
  picture = draw_one(*view, scene);
  EXPECT_EQ(seen_at(picture, eye_, {0.003, 0.003, 0.01}), 'r');
  EXPECT_EQ(seen_at(picture, eye_, {0.0075, 0.0, 0.008}), '.');
  EXPECT_EQ(seen_at(picture, eye_, {0.0, -0.0075, 0.008}), '.');
}

TEST_F(SceneTest, AnEyeInsideAVolumeSeesItsWallAround) {
  // A hollow: 1 outside a ball of 20 mm, with the eye in its middle.
  const auto hollow = still_volume(
      64, 1.0, [](glm::dvec3 x) { return std::clamp(glm::length(x) - 20.0 + 0.5, 0.0, 1.0); });
  RendererOptions options{kSceneSize, 1};
  options.near_m = 0.001;
  options.samples_per_voxel = 8.0;
  auto view = renderer(options);
  set(*view, {hollow});
  ViewScene scene;
  scene.volumes = {{hollow, {}, {}, ball_look(kRed)}};
  Eye inside = eye_;
  inside.position_m = glm::dvec3(0.0);
  const Picture picture = draw(*view, scene, {inside}, kSceneSize)[0];
  for (int y = 5; y < kSceneSize.height; y += 20)
    for (int x = 5; x < kSceneSize.width; x += 20) {
      const float depth = picture.depths[size_t(y * kSceneSize.width + x)];
      ASSERT_GT(depth, 0.0F);
      const double away_m =
          options.near_m / double(depth) * glm::length(ray_of(inside, kSceneSize, x, y));
      // Half the light is absorbed within 0.2 mm of the surface; samples are 0.125 mm apart.
      EXPECT_NEAR(away_m, 0.020, 0.0004) << x << ", " << y;
    }
}

/// What an eye sees of one face's letters: tangents.
struct SeenLetters {
  glm::dvec2 low{1e300}, high{-1e300};
};
/// In the order of add_letters: the faces before and after the box along each of its axes.
std::vector<SeenLetters> letters_of(const Things& things, const DataBox& box, const Eye& eye) {
  const std::map<char, int> rods = {{'L', 2}, {'R', 10}, {'P', 9}, {'A', 3}, {'S', 15}, {'I', 3}};
  std::vector<SeenLetters> faces;
  size_t next = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      SeenLetters of;
      for (const char letter : side_of(sign * box.axes[axis]))
        for (int n = 0; n < rods.at(letter) && next < things.size(); ++n, ++next)
          for (const glm::dvec3 end : {things[next].from, things[next].to}) {
            const glm::dvec3 seen = glm::conjugate(eye.orientation) * (end - eye.position_m);
            of.low = glm::min(of.low, glm::dvec2(seen) / -seen.z);
            of.high = glm::max(of.high, glm::dvec2(seen) / -seen.z);
          }
      faces.push_back(of);
    }
  EXPECT_EQ(next, things.size()) << "a letter is lost, or is not one of the face's";
  return faces;
}

TEST_F(SceneTest, LettersStandBesideTheBoxFromWhereverItIsSeen) {
  // No letter may be seen before or behind the box or other letters, and none may be lost. A single
  // slice is flat; of a box that lies obliquely in the patient a face has two letters or three.
  constexpr double kHeight = 0.006;
  const glm::dquat turn = glm::angleAxis(0.4, glm::normalize(glm::dvec3(1.0, 2.0, -1.0)));
  Transform turned;
  turned.rotation = turn;
  const glm::dmat3 oblique = glm::mat3_cast(glm::angleAxis(-0.6, glm::dvec3(1.0, 0.0, 0.0)) * turn);
  struct Case {
    Transform place;
    glm::dmat3 axes;
  };
  for (const double half_z : {0.04, 0.0})
    for (const Case& of : {Case{{}, glm::dmat3(1.0)}, Case{turned, glm::dmat3(1.0)},
                           Case{{}, oblique}, Case{turned, oblique}})
      for (int azimuth = 10; azimuth < 360; azimuth += 25)
        for (const int elevation : {-50, -20, 15, 40}) {
          const glm::dvec3 high(0.03, 0.02, half_z);
          const DataBox box{of.axes * -high, of.axes, 2.0 * high};
          const double a = glm::radians(double(azimuth)), e = glm::radians(double(elevation));
          const Eye eye = eye_at(
              0.4 * glm::dvec3(std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)),
              {0.0, 0.0, 0.0}, 0.5, kSceneSize);
          Things things;
          add_letters(things, of.place, box, {&eye, 1}, kHeight, kGreen);
          // Rays to the letters' rods, along the box's own axes from its middle (slabs).
          const auto in_box = [&](glm::dvec3 world) {
            return glm::transpose(box.axes) * of.place.volume_from_world(world);
          };
          for (const RoundCone& rod : things) {
            const glm::dvec3 from = in_box(eye.position_m), way = in_box(rod.from) - from;
            double enters = 0.0, leaves = 1e9;
            for (int axis = 0; axis < 3; ++axis) {
              const double x0 = (-high[axis] - from[axis]) / way[axis];
              const double x1 = (high[axis] - from[axis]) / way[axis];
              enters = std::max(enters, std::min(x0, x1));
              leaves = std::min(leaves, std::max(x0, x1));
            }
            ASSERT_GT(enters, leaves) << half_z << ": " << azimuth << ", " << elevation;
          }
          const std::vector<SeenLetters> faces = letters_of(things, box, eye);
          // Around a slice that is seen from its side there is no room for all of them.
          if (half_z == 0.0) continue;
          for (size_t m = 0; m < faces.size(); ++m)
            for (size_t n = 0; n < m; ++n)
              EXPECT_TRUE(glm::any(glm::greaterThan(faces[m].low, faces[n].high)) ||
                          glm::any(glm::greaterThan(faces[n].low, faces[m].high)))
                  << "faces " << n << " and " << m << ", " << half_z << ": " << azimuth << ", "
                  << elevation;
        }
}

TEST_F(SceneTest, LettersHaveAPlaceHoweverTheBoxIsSeen) {
  // From straight ahead, edge-on, from inside, and a box without any size.
  for (const glm::dvec3 high : {glm::dvec3(0.03), glm::dvec3(0.03, 0.02, 0.0), glm::dvec3(0.0)})
    for (const glm::dvec3 from :
         {glm::dvec3(0, 0, 0.3), glm::dvec3(0.3, 0, 0), glm::dvec3(0.0, 0.001, 0.01)}) {
      Things things;
      const Eye eye = eye_at(from, {0.0, 0.0, -0.001}, 0.5, kSceneSize);
      add_letters(things, {}, straight_box(-high, high), {&eye, 1}, 0.006, kGreen);
      ASSERT_FALSE(things.empty());
      for (const RoundCone& rod : things)
        for (const glm::dvec3 end : {rod.from, rod.to})
          ASSERT_LT(glm::length(end), 0.2) << high.x << " from " << from.z;
    }
}

TEST_F(SceneTest, LettersComeInForBothEyes) {
  // A box that fills the picture from one side to the other: its letters would be cut at the left
  // border of the right eye's picture and at the right border of the left eye's.
  constexpr double kHeight = 0.006;
  const DataBox box = straight_box(glm::dvec3(-0.09, -0.03, -0.03), glm::dvec3(0.09, 0.03, 0.03));
  std::array<Eye, 2> eyes;
  Eye middle = eye_at({0.0, 0.0, 0.4}, {0.0, 0.0, 0.0}, 0.5, kSceneSize);
  middle.tan_left = -0.27, middle.tan_right = 0.27;
  split_eyes(middle, 0.01, eyes[0], eyes[1]);
  const auto cut = [&](const Things& things, const Eye& eye) {
    return std::any_of(things.begin(), things.end(), [&](const RoundCone& rod) {
      const glm::dvec3 seen = glm::conjugate(eye.orientation) * (rod.from - eye.position_m);
      const glm::dvec2 at = glm::dvec2(seen) / -seen.z;
      return at.x < eye.tan_left || at.x > eye.tan_right || at.y < eye.tan_down ||
             at.y > eye.tan_up;
    });
  };
  Things of_first, of_both;
  add_letters(of_first, {}, box, {eyes.data(), 1}, kHeight, kGreen);
  add_letters(of_both, {}, box, eyes, kHeight, kGreen);
  EXPECT_FALSE(cut(of_first, eyes[0]));
  EXPECT_TRUE(cut(of_first, eyes[1]));
  EXPECT_FALSE(cut(of_both, eyes[0]));
  EXPECT_FALSE(cut(of_both, eyes[1]));
}

TEST_F(SceneTest, LettersStandOnThePatientsSides) {
  // One bright ball on the patient's left, written into LPS samples; viewed from the front, so that
  // the patient's left is on the viewer's right.
  Volume volume;
  volume.grid.size = glm::ivec3(64);
  volume.grid.spacing_mm = glm::dvec3(1.0);
  volume.grid.origin_mm = glm::dvec3(-31.5);
  for (int k = 0; k < 64; ++k)
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i) {
        const glm::dvec3 lps = volume.grid.lps_from_index(glm::dvec3(i, j, k));
        volume.values.push_back(glm::length(lps - glm::dvec3(20, 0, 0)) < 8.0 ? 1.0F : 0.0F);
      }
  MovingVolume moving;
  moving.name = "patient";
  moving.times.times_s = {0.0};
  moving.frames = {sampled_scalar(std::move(volume))};
  const auto patient = std::make_shared<const MovingVolume>(std::move(moving));
  auto view = renderer({kSceneSize, 1});
  set(*view, {patient});
  ViewScene scene;
  scene.volumes = {{patient, {}, {}, ball_look(kRed)}};
  const FrameData& data = *patient->frames[0];
  constexpr double kHeight = 0.012;
  add_letters(scene.things, {}, box_of(data), {&eye_, 1}, kHeight, kGreen);
  const Picture picture = draw_one(*view, scene);
  // The volume's +z is anterior, so an eye at +z is in front of the patient.
  EXPECT_EQ(seen_at(picture, eye_, {0.020, 0.0, 0.007}), 'r');
  EXPECT_EQ(seen_at(picture, eye_, {-0.020, 0.0, 0.007}), '.');
  // The letter beside the ball is an L and not mirrored: its stem is at the left, its foot at the
  // right.
  const glm::dvec3 l(0.032 + 1.1 * kHeight, 0.0, 0.0);
  EXPECT_EQ(seen_at(picture, eye_, l + kHeight * glm::dvec3(-0.26, 0.3, 0.0)), 'g');
  EXPECT_EQ(seen_at(picture, eye_, l + kHeight * glm::dvec3(0.2, -0.5, 0.0)), 'g');
  EXPECT_EQ(seen_at(picture, eye_, l + kHeight * glm::dvec3(0.2, 0.3, 0.0)), '.');
  // Opposite it there is an R: its bowl is at the upper right.
  const glm::dvec3 r(-0.032 - 1.1 * kHeight, 0.0, 0.0);
  EXPECT_EQ(seen_at(picture, eye_, r + kHeight * glm::dvec3(-0.28, 0.0, 0.0)), 'g');
  EXPECT_EQ(seen_at(picture, eye_, r + kHeight * glm::dvec3(0.3, 0.25, 0.0)), 'g');
  EXPECT_EQ(seen_at(picture, eye_, r + kHeight * glm::dvec3(0.3, -0.1, 0.0)), '.');
  // S above, and no volume where the background is.
  EXPECT_EQ(
      seen_at(picture, eye_,
              glm::dvec3(0.0, 0.032 + 1.1 * kHeight, 0.0) + kHeight * glm::dvec3(-0.28, 0.31, 0)),
      'g');
}

TEST_F(SceneTest, OfBodiesAtTheSameDepthTheSameOneIsSeenInEveryOrder) {
  const auto nothing = still_volume(8, 1.0, [](glm::dvec3) { return 0.0; });
  auto view = renderer({kSceneSize, 1});
  set(*view, {nothing});
  const auto drawn = [&](const std::vector<glm::dvec3>& colours) {
    ViewScene scene;
    scene.volumes = {{nothing, {}, {}, ball_look(kRed)}};
    for (const glm::dvec3 colour : colours)
      scene.things.push_back({{-0.02, 0.0, 0.0}, {0.02, 0.01, 0.0}, 0.006, 0.003, colour});
    return draw_one(*view, scene);
  };
  const Picture red = drawn({kRed, kGreen, kBlue});
  EXPECT_EQ(drawn({kBlue, kGreen, kRed}).colours, red.colours);
  EXPECT_EQ(drawn({kGreen, kRed, kBlue}).colours, red.colours);
  EXPECT_NE(drawn({kRed}).colours, drawn({kBlue}).colours);
}

TEST_F(SceneTest, BothEyesTakeTheirSamplesAtTheSameDepths) {
  // Two equal eyes get the same picture, bit by bit: it does not depend on the eye's index.
  const auto heart = beating_heart();
  auto view = renderer({kSceneSize, 2});
  set(*view, {heart});
  ViewScene scene;
  scene.volumes = {{heart, {}, {0, 0.3}, *preset_look("phantom")}};
  add_box(scene.things, {}, straight_box(glm::dvec3(-0.03), glm::dvec3(0.03)), 0.001, kBlue);
  const std::vector<Picture> same = draw(*view, scene, {eye_, eye_}, kSceneSize);
  EXPECT_EQ(same[0].colours, same[1].colours);
  EXPECT_EQ(same[0].depths, same[1].depths);
  // An eye gets the same picture alone and as one of two.
  Eye left, right;
  split_eyes(eye_, 0.06, left, right);
  const std::vector<Picture> both = draw(*view, scene, {left, right}, kSceneSize);
  EXPECT_EQ(both[1].colours, draw(*view, scene, {right}, kSceneSize)[0].colours);
  EXPECT_NE(both[0].colours, both[1].colours);
}

TEST_F(SceneTest, WholeFramesStandStillUntilTheNextOne) {
  const auto heart = beating_heart();
  auto view = renderer({kSceneSize, 1});
  set(*view, {heart});
  ViewScene scene;
  scene.volumes = {{heart, {}, {0, 0.0}, *preset_look("phantom")}};
  const Picture start = draw_one(*view, scene);
  scene.volumes[0].pointer.phase = 0.9;
  const Picture moved = draw_one(*view, scene);
  scene.volumes[0].whole_frames = true;
  const Picture whole = draw_one(*view, scene);
  EXPECT_EQ(start.colours, whole.colours);
  EXPECT_NE(start.colours, moved.colours);
}

TEST_F(SceneTest, ACarriedVolumeTakesThePlaceOfItsFrames) {
  // The same renderer, first with frames of their own values, then with a carried frame. At the
  // carried frame's own time nothing changes except the smoothing of two interpolations; at other
  // times the values move, and there is no jump between a frame's end and the next one's start.
  const auto own = beating_heart(), carried = carried_heart(false);
  auto view = renderer({kSceneSize, 1});
  set(*view, {own});
  ViewScene scene;
  scene.volumes = {{own, {}, {1, 0.0}, *preset_look("phantom")}};
  const Picture before = draw_one(*view, scene);
  set(*view, {carried});
  const auto at = [&](int frame, double phase) {
    scene.volumes = {{carried, {}, {frame, phase}, *preset_look("phantom")}};
    return draw_one(*view, scene);
  };
  const Picture after = at(1, 0.0);
  EXPECT_GT(psnr_db(before, after), 40.0);
  EXPECT_LT(psnr_db(before, at(0, 0.0)), 30.0);
  for (int frame = 0; frame < 4; ++frame)
    EXPECT_GT(psnr_db(at(frame, 0.9999), at((frame + 1) % 4, 0.0)), 48.0) << frame;
  // Back at its own time the picture is as before, whatever was drawn in between.
  EXPECT_GT(psnr_db(after, at(1, 0.0)), 60.0);
  scene.volumes[0].whole_frames = true;
  scene.volumes[0].pointer = {3, 0.5};
  EXPECT_GT(psnr_db(after, draw_one(*view, scene)), 40.0);
}

TEST_F(SceneTest, ABetterMotionTakesOverWithoutAJump) {
  // Seven tenths of the shell's motion, on another grid than the whole of it.
  const MovingVolume& own = *beating_heart();
  const auto moved_by = [&](const Grid& grid, float share) {
    SequenceMotion motion = shell_motion(grid, own.times, 1, true);
    for (Field& term : motion.terms)
      for (glm::vec3& u : term.u_mm) u *= share;
    return *carried(own, motion);
  };
  const Grid fine = heart_grid(64);
  Grid coarse_grid = fine;
  coarse_grid.size = {30, 26, 28};
  coarse_grid.origin_mm = fine.lps_from_index({-3.0, -1.0, -2.0});
  coarse_grid.spacing_mm =
      fine.spacing_mm * (glm::dvec3(fine.size) + 4.0) / glm::dvec3(coarse_grid.size - 1);
  const auto coarse = std::make_shared<const MovingVolume>(moved_by(coarse_grid, 0.7F));
  MovingVolume next = moved_by(fine, 1.0F);
  ASSERT_TRUE(can_blend(*coarse, next));
  next.whole_before = coarse->whole;
  const auto better = std::make_shared<const MovingVolume>(std::move(next));
  const auto picture = [&](VolumeRenderer& view, const std::shared_ptr<const MovingVolume>& volume,
                           double share) {
    ViewScene scene;
    scene.volumes = {{volume, {}, {3, 0.3}, *preset_look("phantom")}};
    scene.volumes[0].whole_share = share;
    return draw_one(view, scene);
  };
  auto view = renderer({kSceneSize, 1});
  set(*view, {coarse});
  const Picture before = picture(*view, coarse, 1.0);
  set(*view, {better});
  const Picture at_first = picture(*view, better, 0.0), half_way = picture(*view, better, 0.5),
                at_last = picture(*view, better, 1.0);
  EXPECT_GT(psnr_db(before, at_first), 50.0);
  EXPECT_LT(psnr_db(before, at_last), 35.0) << "the better motion is another one";
  // Half of the way is the mean of both.
  auto fresh = renderer({kSceneSize, 1});
  const auto mean = std::make_shared<const MovingVolume>(moved_by(fine, 0.85F));
  set(*fresh, {mean});
  EXPECT_GT(psnr_db(picture(*fresh, mean, 1.0), half_way), 50.0);
  // Where the former was never shown there is nothing to come from.
  set(*fresh, {better});
  EXPECT_EQ(picture(*fresh, better, 0.0).colours, picture(*fresh, better, 1.0).colours);
  EXPECT_GT(psnr_db(picture(*fresh, better, 1.0), at_last), 60.0);
}

/// Two segments that are balls around the origin, in data that show nothing: red of 10 mm in blue
/// of 20 mm.
MovingVolume nested_segments() {
  MovingVolume volume = *still_volume(64, 1.0, [](glm::dvec3) { return 0.0; });
  const auto distance = [](double radius_mm) {
    return still_volume(64, 1.0, [=](glm::dvec3 x) { return radius_mm - glm::length(x); })->frames;
  };
  volume.segments = {{"outer", glm::vec3(kBlue), distance(20.0)},
                     {"inner", glm::vec3(kRed), distance(10.0)}};
  return volume;
}

TEST_F(SceneTest, SegmentsAreSurfacesInTheirColours) {
  const auto volume = std::make_shared<const MovingVolume>(nested_segments());
  auto view = renderer({kSceneSize, 1});
  set(*view, {volume});
  ViewScene scene;
  scene.volumes = {{volume, {}, {}, step_look(5000.0)}};
  const auto covered = [&](const Picture& picture, int x) {
    return channel(picture, x, kSceneSize.height / 2, 3) / 255.0;
  };
  const int middle = kSceneSize.width / 2;
  EXPECT_EQ(covered(draw_one(*view, scene), middle), 0.0);
  // Through the middle a ray crosses each surface twice, at a right angle.
  scene.volumes[0].segment_opacity = 0.3;
  const Picture both = draw_one(*view, scene);
  EXPECT_NEAR(covered(both, middle), 1.0 - std::pow(0.7, 4.0), 0.015);
  EXPECT_EQ(seen_at(both, eye_, {0.0, 0.0165, 0.0}), 'b');
  EXPECT_EQ(seen_at(both, eye_, {0.0, 0.0215, 0.0}), '.');
  // Opaque segments hide what is inside; where the cut removes the outer one, the inner one is
  // visible.
  scene.volumes[0].segment_opacity = 0.99;
  EXPECT_EQ(seen_at(draw_one(*view, scene), eye_, {0.0, 0.0, 0.02}), 'b');
  scene.clips = {{{0.0, 0.0, -1.0}, -0.015}};  // keeps z < 15 mm
  const Picture cut = draw_one(*view, scene);
  EXPECT_EQ(seen_at(cut, eye_, {0.0, 0.0, 0.01}), 'r');
  // A shape between the two surfaces is visible through the outer one.
  scene.volumes[0].segment_opacity = 0.3;
  scene.clips.clear();
  add_sphere(scene.things, {0.0, 0.0, 0.014}, 0.002, kGreen);
  EXPECT_EQ(seen_at(draw_one(*view, scene), eye_, {0.0, 0.0, 0.016}), 'g');
  scene.volumes[0].segment_opacity = 1.0;
  EXPECT_FALSE(view->start(scene, std::vector{eye_}, kSceneSize));
}

TEST_F(SceneTest, SegmentsAreCarriedAsTheirVolumeIs) {
  MovingVolume own = nested_segments();
  own.times = {{0.0, 0.5}, 1.0};
  own.frames.push_back(own.frames[0]);
  for (Segment& segment : own.segments) segment.distance_mm.push_back(segment.distance_mm[0]);
  Grid grid;
  grid.size = glm::ivec3(9);
  grid.spacing_mm = glm::dvec3(8.0);
  grid.origin_mm = glm::dvec3(-32.0);
  SequenceMotion motion;
  motion.basis = {own.times.times_s, own.times.cycle_s, 0};
  motion.terms = {still_field(grid), still_field(grid)};
  for (glm::vec3& u : motion.terms[1].u_mm) u = glm::vec3(10.0F, 0.0F, 0.0F);
  const auto volume = std::make_shared<const MovingVolume>(*carried(own, motion));
  auto view = renderer({kSceneSize, 1});
  set(*view, {volume});
  ViewScene scene;
  scene.volumes = {{volume, {}, {0, 0.0}, step_look(5000.0)}};
  scene.volumes[0].segment_opacity = 0.99;
  const Picture start = draw_one(*view, scene);
  EXPECT_EQ(seen_at(start, eye_, {-0.018, 0.0, 0.0}), 'b');
  EXPECT_EQ(seen_at(start, eye_, {0.026, 0.0, 0.0}), '.');
  scene.volumes[0].pointer = {1, 0.0};
  const Picture moved = draw_one(*view, scene);
  EXPECT_EQ(seen_at(moved, eye_, {-0.018, 0.0, 0.0}), '.');
  EXPECT_EQ(seen_at(moved, eye_, {0.026, 0.0, 0.0}), 'b');
}

TEST_F(SceneTest, DeviceMemoryIsElevenBytesPerVoxelAndThreeForEachFurtherFrame) {
  constexpr int kSize = 128;
  const auto frame = [](double level) {
    return still_volume(kSize, 1.0, [=](glm::dvec3 x) { return level - glm::length(x); });
  };
  const auto still = frame(30.0);
  MovingVolume sequence = *still;
  sequence.times = {{0.0, 0.1, 0.2}, 0.3};
  for (const double level : {31.0, 32.0}) sequence.frames.push_back(frame(level)->frames[0]);
  const auto moving = std::make_shared<const MovingVolume>(std::move(sequence));
  auto view = renderer({kSceneSize, 1});
  const auto used_for = [&](const std::shared_ptr<const MovingVolume>& volume) {
    set(*view, {volume});
    ViewScene scene;
    scene.volumes = {{volume, {}, {}, step_look(0.0)}};
    draw_one(*view, scene);
    return double(context()->memory_used_bytes()) / (kSize * kSize * kSize);
  };
  set(*view, {});
  const double own = double(context()->memory_used_bytes()) / (kSize * kSize * kSize);
  const double one = used_for(still), three = used_for(moving);
  RecordProperty("bytes_per_voxel", std::to_string(one - own));
  // The frame in 2 bytes and the picture in 8, with bounds of parts, nodes, bricks and their bits.
  EXPECT_LT(one - own, 11.5);
  EXPECT_LT((three - one) / 2.0, 2.8);
}

TEST_F(SceneTest, RefusesWhatCanNotBeDrawnInASentence) {
  const auto red = ball({0, 0, 0}), other = ball({0, 0, 0});
  auto view = renderer({kSceneSize, 1});
  set(*view, {red});
  const auto refusal = [&](const ViewScene& scene, std::vector<Eye> eyes, PictureSize size) {
    const Status status = view->start(scene, eyes, size);
    return status ? std::string() : status.error().message;
  };
  ViewScene scene;
  using ::testing::HasSubstr;
  EXPECT_THAT(refusal(scene, {eye_}, kSceneSize), HasSubstr("no volumes"));
  scene.volumes = {{other, {}, {}, ball_look(kRed)}};
  EXPECT_THAT(refusal(scene, {eye_}, kSceneSize), HasSubstr("not given to set_volumes"));
  scene.volumes = {{nullptr, {}, {}, ball_look(kRed)}};
  EXPECT_THAT(refusal(scene, {eye_}, kSceneSize), HasSubstr("not given to set_volumes"));
  scene.volumes = {{red, {}, {}, ball_look(kRed)}};
  EXPECT_THAT(refusal(scene, {}, kSceneSize), HasSubstr("no eyes"));
  EXPECT_THAT(refusal(scene, {eye_, eye_}, kSceneSize), HasSubstr("more than"));
  EXPECT_THAT(refusal(scene, {eye_}, {kSceneSize.width + 1, 8}), HasSubstr("larger"));
  scene.clips.resize(9);
  EXPECT_THAT(refusal(scene, {eye_}, kSceneSize), HasSubstr("clip planes"));
  scene.clips.clear();
  scene.volumes[0].look.points[0].opacity = 2.0;
  EXPECT_THAT(refusal(scene, {eye_}, kSceneSize), HasSubstr("opacity"));
  scene.volumes[0].look = ball_look(kRed);
  EXPECT_EQ(refusal(scene, {eye_}, kSceneSize), "");
  EXPECT_FALSE(view->set_volumes(std::vector<std::shared_ptr<const MovingVolume>>(5, red)));
  EXPECT_FALSE(view->set_volumes(std::vector<std::shared_ptr<const MovingVolume>>(1)));
  EXPECT_FALSE(VolumeRenderer::make(context(), {{0, 5}, 1}));
  EXPECT_FALSE(VolumeRenderer::make(context(), {kSceneSize, 5}));
}

}  // namespace
}  // namespace palpate::test
