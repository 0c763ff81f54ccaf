#pragma once

#include <vector>

#include "module/scene/frame_data.h"
#include "module/scene/scene_spec.h"

namespace palpate {

/// The modes of a scene: those that are written in it, in their order, and then a surface for each
/// felt segment of its volumes that none of them reads. They are named as their segments, with the
/// volume's name before it where that is taken.
std::vector<ModeSpec> modes_of(const SceneSpec& spec);

/// The strength of a segment's wall at a distance from its border (mm of the data, above 0 inside):
/// it grows with the depth from 0 to the strength. Where the strength grows by K newtons per metre,
/// the proxy comes to rest where K depth = k (hand - depth), k being the stiffness of the scene's
/// spring. Pressed slowly, the hand feels both springs in series, k K / (k + K), up to the
/// strength. The depth is measured in the world: `scale` is that of the volume in it.
TransferFunction segment_strength(const SegmentSpec& segment, double scale);

/// Half the thickness, mm of the data, that a wall needs so that a hand that presses it with a
/// force stays in its half: behind the middle another side is nearer, and the hand falls through.
/// The hand is behind the surface by F / k, the proxy by F / K: half of (F / k + F / K) / scale.
/// `scale` is that of the volume in the world, k the stiffness of the scene's spring and K the
/// wall's.
double half_thickness_mm(double force_n, double spring_n_per_m, double wall_n_per_m, double scale);

/// What the wall of a segment holds at its thin places.
struct WallHold {
  double force_n = 0.0;      ///< at nine tenths of its places, at least
  double thickness_m = 0.0;  ///< of these, in the world
};

/// Looks at some hundred places of a segment's border, inwards along the gradient of its distance
/// (mm, above 0 inside) to where it is largest, at most as far as the strength grows. A place holds
/// the largest strength on this way, as a surface has it there (sure_strength()), and is as thick
/// as the way straight through it. For walls without a border: all 0. Any thread.
WallHold wall_hold(const FrameData& distance, const SegmentSpec& segment, double scale);

/// The stiffness with which a segment's wall holds its strength where it is thin, N/m: the least of
/// its own one, twice that, ... and 16 times that; the last if none is enough. In series with the
/// scene's softer spring it is hardly felt. Any thread.
double holding_stiffness(const FrameData& distance, const SegmentSpec& segment, double scale);

/// The strength of a surface that reads a distance: where another side of it becomes the nearest,
/// the distance is flat (slope 0, else 1) and turns round. Towards that the strength goes to 0,
/// smoothly. slope: length of the distance's gradient. Real-time safe.
double sure_strength(double strength_n, double slope);

/// What a wall should hold: a firm press, N.
inline constexpr double kFirmPress_n = 3.0;

}  // namespace palpate
