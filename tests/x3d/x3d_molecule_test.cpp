// The paper's molecule, written with the nodes of its own system, is the built-in molecule: the
// same modes, strengths and transforms, and the same forces on the same path of the hand.
#include <gtest/gtest.h>

#include <cmath>

#include "integration/x3d/x3d_file.h"
#include "module/haptics/proxy/haptics.h"
#include "module/scene/analytic_data.h"
#include "module/scene/built_in.h"
#include "module/scene/drive.h"
#include "module/scene/make_volume.h"

namespace palpate::x3d {
namespace {

SceneSpec example() {
  const auto scene = read_x3d(PALPATE_SOURCE_DIR "/docs/examples/dichloroethane.x3d");
  EXPECT_TRUE(scene) << scene.error().message;
  return scene ? scene->spec : SceneSpec{};
}

TEST(X3dMolecule, HasTheModesStrengthsAndTransformsOfTheBuiltInOne) {
  const SceneSpec read = example(), built_in = molecule_scene();
  EXPECT_EQ(read.stiffness_n_per_m, built_in.stiffness_n_per_m);
  EXPECT_EQ(read.damping_n_s_per_m, built_in.damping_n_s_per_m);
  EXPECT_EQ(read.max_force_n, built_in.max_force_n);
  EXPECT_EQ(read.world_from_device, built_in.world_from_device);
  ASSERT_EQ(read.modes.size(), built_in.modes.size());
  const ModeSpec &m = read.modes[0], &n = built_in.modes[0];
  EXPECT_EQ(m.name, n.name);
  EXPECT_EQ(m.kind, n.kind);
  EXPECT_EQ(m.volume, n.volume);
  EXPECT_EQ(m.vector, n.vector);
  EXPECT_EQ(m.strength.in(), n.strength.in());
  EXPECT_EQ(m.strength.out(), n.strength.out());
  EXPECT_EQ(m.on, n.on);
  ASSERT_EQ(read.volumes.size(), built_in.volumes.size());
  const VolumeSpec &v = read.volumes[0], &w = built_in.volumes[0];
  EXPECT_EQ(v.name, w.name);
  EXPECT_EQ(v.transform, w.transform);
  EXPECT_EQ(v.drive.kind, w.drive.kind);
  EXPECT_EQ(v.drive.axis, w.drive.axis);
  EXPECT_EQ(v.drive.rate_hz, w.drive.rate_hz);
  EXPECT_EQ(v.drive.centre_m, w.drive.centre_m);
  EXPECT_EQ(v.path, w.path);
}

/// The forces (N) on a hand that moves back and forth through the molecule on a knotted path.
std::vector<glm::dvec3> forces_on(const SceneSpec& spec) {
  const auto volume = build(spec.volumes[0]);
  EXPECT_TRUE(volume) << volume.error().message;
  const auto scene = plan(spec, {std::make_shared<const MovingVolume>(*volume)});
  EXPECT_TRUE(scene) << scene.error().message;
  DeviceInfo device;
  device.max_force_n = 100.0;
  device.max_stiffness_n_per_m = 1e5;
  device.workspace_radius_m = 1.0;
  HapticsOptions options;
  options.safety.start_ramp_s = 0.0;
  Haptics haptics(options, device);
  haptics.adopt(Haptics::prepare(*scene));
  std::vector<glm::dvec3> forces;
  for (int k = 0; k < 4000; ++k) {
    const double t = 1e-3 * k;
    TickInput input;
    input.now_ns = input.reading.time_ns = int64_t(k + 1) * 1'000'000;
    input.reading.fresh = true;
    input.reading.position_m = {0.05 * std::sin(2.1 * t), 0.05 * std::sin(3.3 * t + 0.4),
                                0.04 * std::sin(1.7 * t + 1.0)};
    forces.push_back(haptics.tick(input).wanted_n);
  }
  return forces;
}

TEST(X3dMolecule, GivesTheForcesOfTheBuiltInOne) {
  const std::vector<glm::dvec3> read = forces_on(example()), built_in = forces_on(molecule_scene());
  ASSERT_EQ(read.size(), built_in.size());
  double largest = 0.0, farthest = 0.0;
  for (size_t k = 0; k < read.size(); ++k) {
    largest = std::max(largest, glm::length(built_in[k]));
    farthest = std::max(farthest, glm::length(read[k] - built_in[k]));
  }
  RecordProperty("largest_n", std::to_string(largest));
  RecordProperty("farthest_n", std::to_string(farthest));
  EXPECT_GT(largest, 1.0);
  // The example writes its numbers with six decimals: places to half a micrometre.
  EXPECT_LT(farthest, 5e-4);
}

TEST(X3dMolecule, KeysGiveTheForcesOfTheTurnThatTheySay) {
  // The molecule beside its middle, as a rotation and as keys, within a place of its own: from the
  // first tick on the hand meets the same.
  SceneSpec turn = molecule_scene(), keys = turn;
  turn.volumes[0].drive.centre_m = {0.01, 0.0, 0.0};
  turn.volumes[0].drive.rate_hz = 0.5;
  turn.volumes[0].transform.translation_m = {0.0, 0.01, 0.005};
  KeyedPose outer, round;
  outer.pose.translation_m = turn.volumes[0].drive.centre_m;
  for (int k = 0; k <= 8; ++k) {
    round.rotation.keys.push_back(k / 8.0);
    round.rotation.values.push_back(
        glm::angleAxis(2.0 * 3.14159265358979323846 * k / 8.0, glm::dvec3(0, 1, 0)));
  }
  round.rotation.cycle_s = 2.0;
  VolumeSpec& volume = keys.volumes[0];
  volume.drive.kind = DriveSpec::Kind::kKeys;
  volume.drive.poses = {outer, round};
  volume.transform.translation_m = glm::dvec3(0.0, 0.01, 0.005) - outer.pose.translation_m;
  const std::vector<glm::dvec3> a = forces_on(turn), b = forces_on(keys);
  double largest = 0.0, farthest = 0.0;
  for (size_t k = 0; k < a.size(); ++k) {
    largest = std::max(largest, glm::length(a[k]));
    farthest = std::max(farthest, glm::length(a[k] - b[k]));
  }
  EXPECT_GT(largest, 1.0);
  EXPECT_LT(farthest, 1e-6);
}

TEST(X3dMolecule, ChargesAreTheMoleculeToTheBit) {
  SceneSpec scene = molecule_scene();
  const auto molecule = build(scene.volumes[0]);
  ASSERT_TRUE(molecule);
  const FrameData& frame = *molecule->frames[0];
  scene.volumes[0].source = "charges";
  scene.volumes[0].charges = dichloroethane_charges();
  scene.volumes[0].box_m = frame.high_m() - frame.low_m();
  const auto text = x3d_text(scene, "scene.x3d");
  ASSERT_TRUE(text) << text.error().message;
  const auto back = parse_x3d("scene.x3d", text->text);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->spec.volumes[0].charges, dichloroethane_charges());
  const auto again = build(back->spec.volumes[0]);
  ASSERT_TRUE(again);
  for (const glm::dvec3 x : {glm::dvec3(0.01, 0.02, 0.03), glm::dvec3(-0.04, 0.0, 0.01)}) {
    EXPECT_EQ(again->frames[0]->scalar(x), frame.scalar(x));
    EXPECT_EQ(again->frames[0]->vector(x), frame.vector(x));
  }
  EXPECT_LT(glm::length(again->frames[0]->low_m() - frame.low_m()), 1e-15);
}

}  // namespace
}  // namespace palpate::x3d
