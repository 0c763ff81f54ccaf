#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "module/scene/look.h"
#include "module/scene/raw_samples.h"
#include "module/scene/transfer.h"
#include "module/scene/transform.h"

namespace palpate {

/// What there is to feel, as a person writes it down: names, files, numbers. Values only; nothing
/// is loaded yet.

/// What a mode reads as its scalar.
enum class ScalarProperty : uint8_t {
  kValue,
  kGradientMagnitude,
  kMagnitude,
  kDivergence,
  kCurlMagnitude
};
/// What a mode reads as its vector.
enum class VectorProperty : uint8_t { kVector, kGradient, kCurl };

struct ModeSpec {
  std::string name;  ///< unique in the scene
  /// surface, follow, front, vortex, gradient-force, vector-force, attractor, tissue, viscosity, or
  /// one of your own
  std::string kind = "surface";
  std::string volume;  ///< name of the volume it reads
  /// reads this segment's signed distance (mm, above 0 inside) instead of the volume's values;
  /// empty: the values
  std::string segment;
  std::string motion;  ///< name of the motion that carries it; empty: the volume's first
  ScalarProperty scalar = ScalarProperty::kValue;
  VectorProperty vector = VectorProperty::kVector;
  /// N, of the scalar (surface, gradient-force, attractor) or of the vector's length; viscosity: N
  /// at 1 m/s
  TransferFunction strength;
  TransferFunction friction;  ///< Coulomb's mu, of the scalar; surface only
  double gain = 1.0;          ///< force modes: C of equations (2), (3)
  /// surface: holds when entering and when leaving higher values; front: both sides
  bool two_sided = false;
  /// surface: holds when leaving higher values instead of when entering them
  bool leaving = false;
  glm::dvec3 point_m{0.0};  ///< attractor: volume space, m
  double range_m = 0.0;     ///< attractor: reach; 0 is without end
  bool on = true;
};

/// Values at shares of a cycle. In between places and scales are blended linearly and rotations
/// along the shorter way (slerp), as X3D's interpolators do; before the first and after the last
/// key they stay.
template <class T>
struct KeyTrack {
  std::vector<double> keys;  ///< shares of the cycle, rising, 0 to 1; none: nothing changes
  std::vector<T> values;     ///< one per key
  double cycle_s = 1.0;      ///< how long the way from share 0 to share 1 takes
  bool loop = true;          ///< repeats; else it runs once and stays at its end
  bool operator==(const KeyTrack&) const = default;
};

/// A transform of which parts change by keys.
struct KeyedPose {
  Transform pose;  ///< what has no keys stays as it is here
  KeyTrack<glm::dvec3> translation_m;
  KeyTrack<glm::dquat> rotation;
  KeyTrack<glm::dvec3> scale;
  bool operator==(const KeyedPose&) const = default;
};

/// How a volume's transform changes by itself; a second hand or a program may change it too.
struct DriveSpec {
  enum class Kind : uint8_t { kStill, kTurn, kSwing, kSecondHand, kKeys } kind = Kind::kStill;
  glm::dvec3 axis{0.0, 1.0, 0.0};  ///< of turning and swinging, world
  glm::dvec3 centre_m{0.0};        ///< of turning, world
  double rate_hz = 0.25;           ///< turns or swings per second
  double amplitude_m = 0.01;       ///< of a swing, along the axis
  /// kKeys: transforms one within the other, the outermost first; the volume's own is innermost.
  std::vector<KeyedPose> poses;
};

/// How the pose at a haptic frame's time is found.
enum class PosePath : uint8_t {
  /// a C1 path through the poses at their own times, a little late: no tick at frame ends
  kSmooth,
  kPaper,  ///< the paper's: lerp and slerp from the current pose over the estimated frame time
  kExact,  ///< the source is asked for the pose at the haptic frame's own time (scripted drives)
};

/// The best path for a drive: the exact pose where the source can give it, the smooth path where
/// poses arrive irregularly.
constexpr PosePath usual_path(DriveSpec::Kind drive) {
  return drive == DriveSpec::Kind::kStill || drive == DriveSpec::Kind::kSecondHand
             ? PosePath::kSmooth
             : PosePath::kExact;
}

/// Which frame's values are felt and shown at all times.
enum class CarriedValues : uint8_t {
  kReference,  ///< one frame's, carried by one motion for all frames
  /// the mean of all frames, each read at the same material, carried likewise: less noise
  kMean,
  kOwn,  ///< each frame's own: right where values change by themselves (flows, simulations)
};

enum class BackTracking : uint8_t { kNewton, kPicard };

struct MotionSpec {
  std::string name = "data";
  /// one per step, in order; a folder stands for its files
  std::vector<std::filesystem::path> fields;
  std::vector<std::filesystem::path> confidences;  ///< none or one per field
};

/// How a volume is drawn; this does not change what is felt.
struct AppearanceSpec {
  bool shown = true;
  std::string preset;             ///< of preset_names(); empty: points, or what suits the data
  std::vector<LookPoint> points;  ///< colour and opacity of its own
  /// The points' values are shares of the range of the first frame's values, and their opacities
  /// those of its finest spacing: see over_range().
  bool points_of_range = false;
  double window_level = 0.0;  ///< of the window that the look is brought to
  double width = 0.0;         ///< 0: the look's own window
  /// Stream tubes along vectors, or along the gradient of scalars. None: only vector data have
  /// them.
  std::optional<bool> tubes;
  int tubes_per_axis = 5;        ///< seeds of the tubes
  bool segments = true;          ///< the surfaces of its segments, in their colours
  double segment_opacity = 0.4;  ///< of each of them, 0 to 0.99
  bool operator==(const AppearanceSpec&) const = default;
};

/// A part of a segmentation, and how it is felt and shown.
struct SegmentSpec {
  std::string name;  ///< unique in its volume
  /// The segments of the files that it consists of: their names, or label values as decimal
  /// numbers; none: the one with its own name.
  std::vector<std::string> labels;
  std::optional<glm::dvec3> colour;  ///< red, green, blue, 0 to 1; none: as the file says
  bool felt = true;
  bool shown = true;
  double strength_n = 4.0;            ///< the wall holds as much, from some depth on
  double friction = 0.2;              ///< Coulomb's mu
  double stiffness_n_per_m = 4000.0;  ///< the strength grows by so much with the depth, from 0
  bool operator==(const SegmentSpec&) const = default;
};

/// What segments are made of.
enum class SegmentsFrom : uint8_t {
  kFiles,   ///< label maps
  kRegion,  ///< values of the first frame, or of the reference frame: region_wall()
  kRidges,  ///< likewise: ridge_wall()
};

/// The segments of a volume, which become smooth walls.
struct SegmentsSpec {
  SegmentsFrom from = SegmentsFrom::kFiles;
  std::vector<std::filesystem::path> files;  ///< none; one of one frame; or one per frame
  size_t frame = 0;                          ///< to which a single one belongs
  std::vector<SegmentSpec> parts;            ///< none: all that the files have; of values: "wall"
  std::optional<double> iso_value;           ///< of values: none: found in them
  std::optional<double> smooth_mm;           ///< of values: none: found in them
  /// A part that encloses another fills it: pressing the outer one presses both.
  bool one_body = true;

  bool any() const { return from != SegmentsFrom::kFiles || !files.empty(); }
};

/// A charge that is spread out so that its potential stays finite.
struct PointCharge {
  glm::dvec3 position_m{0.0};  ///< volume space
  double strength_v_m = 0.0;  ///< potential times distance, at large distance: q / (4 pi eps0), V m
  double softness_m = 0.01;   ///< > 0; the potential at the charge is strength / softness
  bool operator==(const PointCharge&) const = default;
};

struct VolumeSpec {
  std::string name;
  std::string source;                ///< "heart", "shell", "molecule", "charges", or empty: files
  std::vector<PointCharge> charges;  ///< of the source "charges": their potential, V
  std::vector<std::filesystem::path> files;  ///< frames, as palpate motion takes them
  std::optional<RawSamples> raw;             ///< the only file has no header: what is in it
  std::optional<double> nan_as;  ///< what samples of scalar files become that are NaN; else refused
  std::vector<MotionSpec> motions;
  Transform transform;  ///< world_from_volume at the start
  bool centred = true;  ///< files: put the middle of the data at the transform's translation
  /// Files: instead of their own size and orientation, the grid's axes i, j, k fill a box of this
  /// size along x, y, z around the transform's origin, as X3D's VolumeData has it. Charges: the box
  /// in which they are data. m, > 0.
  std::optional<glm::dvec3> box_m;
  /// The scene does not give box_m: it is a default, in which an oblique grid keeps its
  /// proportions.
  bool box_assumed = false;
  DriveSpec drive;
  PosePath path = PosePath::kSmooth;
  BackTracking back_tracking = BackTracking::kNewton;
  double frames_per_second = 0.0;  ///< 0: as the file says
  /// how long the whole sequence takes, instead of frames_per_second; 0: as the files say
  double cycle_s = 0.0;
  double rate = 1.0;
  bool cyclic = true;
  /// None: the reference frame's where one motion for all frames is known or found, else its own.
  /// Synthetic data and vectors have their own.
  std::optional<CarriedValues> values;
  bool blend_values = true;  ///< own values: equation (24); off: the frame's own until the next
  AppearanceSpec appearance;
  SegmentsSpec segments;
};

/// A finger pad has no more points than these.
inline constexpr int kMostToolPoints = 5;

struct SceneSpec {
  std::vector<VolumeSpec> volumes;
  std::vector<ModeSpec> modes;
  double stiffness_n_per_m = 600.0;  ///< ks of the spring between probe and proxy
  double damping_n_s_per_m = 0.0;    ///< kd
  double max_force_n = 4.0;
  /// Of what feels, world: of the ball, or with more points than one of the circle on which they
  /// are; 0: a point, or with more points than one 5 mm.
  double tool_radius_m = 0.0;
  int tool_points = 1;          ///< 2 to kMostToolPoints: a finger pad
  Transform world_from_device;  ///< co-location; its scale enlarges the hand's movements
  /// The options of a session that the scene asks for, as a JSON object; empty: none. Read where a
  /// session is opened (integration/running/session_options.h).
  std::string session;
};

}  // namespace palpate
