#include "module/scene/built_in.h"

#include <utility>

namespace palpate {

namespace {

/// Synthetic data of this name with a surface.
SceneSpec surface_scene(const char* name, double frames_per_second, TransferFunction strength) {
  VolumeSpec volume;
  volume.name = volume.source = name;
  volume.frames_per_second = frames_per_second;
  ModeSpec wall;
  wall.name = "wall";
  wall.kind = "surface";
  wall.volume = volume.name;
  wall.strength = std::move(strength);
  wall.friction = TransferFunction::constant(0.2);
  SceneSpec scene;
  scene.volumes = {volume};
  scene.modes = {wall};
  return scene;
}

}  // namespace

SceneSpec heart_scene() {
  // Blood with its texture ends at 245, muscle begins at 485.
  SceneSpec scene = surface_scene("heart", 4.0, *TransferFunction::window(350.0, 100.0, 5.0));
  // The middle of the device is in front of the ventricles, so that the hand meets a wall that
  // moves.
  scene.world_from_device.translation_m = {-0.009, -0.006, 0.0};
  return scene;
}

SceneSpec shell_scene() {
  // Lung is 100, blood 350, wall 1000: what is above 625 holds. The window is narrow beside these
  // steps, so that the strength rises within the edge and not within the texture of either side.
  return surface_scene("shell", 2.0, *TransferFunction::window(625.0, 150.0, 5.0));
}

SceneSpec molecule_scene() {
  VolumeSpec volume;
  volume.name = "molecule";
  volume.source = "molecule";
  volume.drive.kind = DriveSpec::Kind::kTurn;
  volume.drive.rate_hz = 0.05;
  volume.path = usual_path(volume.drive.kind);
  ModeSpec lines;
  lines.name = "field lines";
  lines.kind = "follow";
  lines.volume = volume.name;
  lines.vector = VectorProperty::kGradient;
  // The gradient is 5 to 90 V/m within reach of the atoms, and has no direction where it is 0.
  lines.strength = *TransferFunction::linear({0.0, 10.0}, {0.0, 2.0});
  SceneSpec scene;
  scene.volumes = {volume};
  scene.modes = {lines};
  scene.stiffness_n_per_m = 400.0;
  return scene;
}

}  // namespace palpate
