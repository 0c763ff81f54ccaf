#pragma once

#include <optional>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/sequence.h"
#include "compute/volume/vector_frame.h"
#include "module/scene/moving_volume.h"
#include "module/scene/scene_spec.h"

namespace palpate {

/// One motion as it was read: a field per step, in order. A field without samples is not known yet:
/// its step stands still. Confidences: none, or one per field (without samples: 1 everywhere).
struct MotionData {
  std::vector<Field> fields;
  std::vector<Confidence> confidences;
};

/// A segment as it was read.
struct SegmentData {
  std::string name;
  glm::vec3 colour{1.0F};
  bool shown = true;
  std::vector<Mask> masks;  ///< one per frame, or one alone, of the frame that the spec names
};

/// What was read from the files of a VolumeSpec. Times come from `frames`, scalars or vectors.
struct VolumeData {
  Sequence frames;                   ///< scalars; its frames are empty where there are vectors
  std::vector<VectorFrame> vectors;  ///< instead of scalars
  std::vector<MotionData> motions;   ///< one per spec.motions, in its order
  /// Instead of motions: one for all times. Then `frames` holds its reference frame alone, or all
  /// for the mean of their values.
  std::optional<SequenceMotion> whole;
  std::vector<SegmentData> segments;
};

/// The volume that is felt and shown, from files that were read. Data are moved in. Times: the
/// file's own from its first frame on, or frame / frames_per_second where the spec gives that, or
/// assumed_times() where neither is known. A cycle closes after the median step. With `whole`,
/// times and cycle are the motion's, at its own pace or at the spec's frames_per_second. kBadInput,
/// in one sentence that names the volume: what is missing, does not fit, lies elsewhere in space,
/// or is not finite. Lays out fields and bounds them, on all cores: not for the servo thread.
Result<MovingVolume> build(const VolumeSpec& spec, VolumeData data);

/// The volume of spec.source: "heart", the beating heart sampled at 1 mm without noise, eight
/// frames in one second, with its true motion. "shell", the beating shell likewise in four frames;
/// "heart-exact" and "shell-exact", the same with frames as formulas; "molecule", dichloroethane,
/// which does not move; "charges", those of the spec. kBadInput for another name, and for charges
/// without a place, a strength or a softness.
Result<MovingVolume> build(const VolumeSpec& spec);

/// The same volume with one motion for all its times, felt and seen as its reference frame's
/// values carried by it, or as the mean of all frames' (kMean, scalars only). That is at X the
/// interquartile mean over k of frame k at X + u(X, t_k). So a frame counts little where its motion
/// is wrong. Its segments are carried likewise: those of another frame f have at X the distance
/// that f has at X + u(X, t_f). At the motion's times. kBadInput if the motion is not that of the
/// volume's frames. Uses all cores.
Result<MovingVolume> carried(const MovingVolume& own, const SequenceMotion& motion,
                             CarriedValues values = CarriedValues::kReference);

/// The volume standing still as its frame k: what is felt until its motion is known. It has all its
/// times. kBadInput if there is no such frame.
Result<MovingVolume> standing_at(const MovingVolume& own, size_t k);

/// The scale, at most 1, by which data of a frame's extents are shown so that their longest edge
/// fits a device that reaches so far from its centre.
double scale_to_reach(const FrameData& frame, double reach_m);
/// Of a usual device.
inline constexpr double kUsualReach_m = 0.05;

/// world_from_volume at the start: the spec's transform, or, if it asks for files to be centred,
/// one that puts the middle of the first frame at the transform's translation, or one that fills
/// the spec's box (filled_box()). kBadInput, in one sentence, if the data can not fill it without
/// shear: it names a box that they can fill.
Result<Transform> start_transform(const VolumeSpec& spec, const MovingVolume& volume);

/// The box that the data of files fill instead of the spec's, m. An oblique grid would be sheared
/// by a box that has not the proportions of its edges. Within 1 % of them (boxes are written with
/// three digits) it keeps its own proportions, and in a box that is only assumed it is as large as
/// fits into that. Otherwise, and without a grid, the spec's box. The spec must have one.
glm::dvec3 filled_box(const VolumeSpec& spec, const MovingVolume& volume);

/// Describes the same place by a box: sets box_m and the transform of a volume of files so that
/// start_transform() gives `world_from_volume` again. kBadInput if the data have no grid, or where
/// that transform stretches them along other axes than the grid's.
Status place_by_box(VolumeSpec& spec, const MovingVolume& volume,
                    const Transform& world_from_volume);

}  // namespace palpate
