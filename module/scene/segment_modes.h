#pragma once

#include <vector>

#include "module/scene/scene_spec.h"

namespace palpate {

/// The modes of a scene: those that are written in it, in their order, and then a surface for each
/// felt segment of its volumes that none of them reads. They are named as their segments, with the
/// volume's name before it where that is taken.
std::vector<ModeSpec> modes_of(const SceneSpec& spec);

/// The strength of a segment's wall at a distance from its border (mm of the data, above 0 inside):
/// it grows with the depth from 0 to the strength. Where the strength grows by K newtons per metre,
/// the proxy comes to rest where K depth = k (hand - depth), k being the stiffness of the scene's
/// spring: pressed slowly, the hand feels both springs in series, k K / (k + K), up to the
/// strength. The depth is measured in the world: `scale` is that of the volume in it.
TransferFunction segment_strength(const SegmentSpec& segment, double scale);

}  // namespace palpate
