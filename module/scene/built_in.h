#pragma once

#include "module/scene/scene_spec.h"

namespace palpate {

/// The beating heart of heart_phantom with surface and friction: eight frames in two seconds. The
/// surface lies between blood or lung (below 250) and all tissue (above 480).
SceneSpec heart_scene();

/// The beating shell of Lundin Palmerius et al. 2008 with surface and friction: four frames, two a
/// second. The surface lies halfway between lung or blood and the wall.
SceneSpec shell_scene();

/// The same paper's molecule: dichloroethane, turned slowly, felt along its field lines.
SceneSpec molecule_scene();

}  // namespace palpate
