#include "module/scene/built_in.h"

namespace palpate {

SceneSpec heart_scene() {
  VolumeSpec volume;
  volume.name = "heart";
  volume.source = "heart";
  volume.frames_per_second = 2.0;
  ModeSpec wall;
  wall.name = "wall";
  wall.kind = "surface";
  wall.volume = volume.name;
  // Lung is 100, blood 350, wall 1000: what is above 625 holds. The window is narrow beside these
  // steps, so that the strength rises within the edge and not within the texture of either side.
  wall.strength = *TransferFunction::window(625.0, 150.0, 5.0);
  wall.friction = TransferFunction::constant(0.2);
  SceneSpec scene;
  scene.volumes = {volume};
  scene.modes = {wall};
  return scene;
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
