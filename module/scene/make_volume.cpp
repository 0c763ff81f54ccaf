#include "module/scene/make_volume.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <utility>

#include "compute/volume/heart_phantom.h"
#include "compute/volume/parallel.h"
#include "compute/volume/phantom.h"
#include "compute/volume/signed_distance.h"
#include "module/scene/analytic_data.h"

namespace palpate {
namespace {

constexpr int kSamples = 128;  // of 1 mm

Error refused(const VolumeSpec& spec, const std::string& what) {
  return {ErrorKind::kBadInput, "The volume \"" + spec.name + "\" can not be used: " + what};
}

bool usable(const Grid& grid, size_t values) {
  const double numbers = glm::dot(grid.origin_mm, glm::dvec3(1.0)) +
                         glm::dot(grid.direction * glm::dvec3(1.0), glm::dvec3(1.0));
  return glm::all(glm::greaterThan(grid.size, glm::ivec3(0))) && values == grid.count() &&
         grid.finest_mm() > 0.0 &&
         std::isfinite(grid.spacing_mm.x * grid.spacing_mm.y * grid.spacing_mm.z) &&
         std::isfinite(numbers);
}

/// Whether the samples of a grid and the box of the data have anything in common.
bool meets(const Grid& grid, const FrameData& data) {
  glm::dvec3 low(1e300), high(-1e300);
  for (int c = 0; c < 8; ++c) {
    const glm::dvec3 end(c & 1, c >> 1 & 1, c >> 2);
    const glm::dvec3 x = volume_from_lps(grid.lps_from_index(end * glm::dvec3(grid.size) - 0.5));
    low = glm::min(low, x);
    high = glm::max(high, x);
  }
  return glm::all(glm::lessThan(low, data.high_m())) && glm::all(glm::lessThan(data.low_m(), high));
}

/// Times with the same shares of another length. cycle_s: 0 where they end at the last frame.
void set_length(std::vector<double>& times_s, double& cycle_s, double length_s) {
  const double factor = length_s / (cycle_s > 0.0 ? cycle_s : times_s.back());
  for (double& time_s : times_s) time_s *= factor;
  cycle_s *= factor;
}

FrameTimes times_of(const VolumeSpec& spec, const Sequence& sequence, size_t frames) {
  FrameTimes times;
  if (spec.frames_per_second > 0.0) {
    for (size_t k = 0; k < frames; ++k) times.times_s.push_back(double(k) / spec.frames_per_second);
  } else if (sequence.times_s.size() == frames) {
    for (const double time_s : sequence.times_s)
      times.times_s.push_back(time_s - sequence.times_s.front());
  } else {
    times.times_s = assumed_times(frames);
    times.assumed = frames > 1 && spec.cycle_s <= 0.0;
  }
  if (spec.cyclic && frames > 1) times.cycle_s = cycle_of(times.times_s);
  if (spec.cycle_s > 0.0 && frames > 1) set_length(times.times_s, times.cycle_s, spec.cycle_s);
  return times;
}

/// True if every value is finite.
bool all_finite(const float* values, size_t count) {
  std::atomic<bool> fine{true};
  constexpr size_t kBlock = 1 << 16;
  const int blocks = int((count + kBlock - 1) / kBlock);
  parallel_ranges(blocks, 0.2 * kBlock, [&](int begin, int end) {
    for (int b = begin; b < end; ++b) {
      const size_t first = size_t(b) * kBlock, last = std::min(count, first + kBlock);
      float nothing = 0.0F;  // 0 times what is not finite is not a number
      for (size_t k = first; k < last; ++k) nothing += 0.0F * values[k];
      if (nothing != 0.0F) fine = false;
    }
  });
  return fine;
}

/// The frames of the files, moved out of `data`.
Result<std::vector<std::shared_ptr<const FrameData>>> frames_of(const VolumeSpec& spec,
                                                                VolumeData& data) {
  std::vector<std::shared_ptr<const FrameData>> frames;
  const auto bad = [&] {
    return refused(spec, "frame " + std::to_string(frames.size()) +
                             " has no samples, or more or fewer than its grid says.");
  };
  const auto not_finite = [&] {
    return refused(spec, "frame " + std::to_string(frames.size()) +
                             " holds values that are not finite; replace them, for example by the "
                             "value of what surrounds the body.");
  };
  for (VectorFrame& frame : data.vectors) {
    if (!usable(frame.grid, frame.values.size())) return bad();
    if (!all_finite(&frame.values[0].x, 3 * frame.values.size())) return not_finite();
    frames.push_back(sampled_vector(frame.grid, std::move(frame.values)));
  }
  for (Volume& frame : data.frames.frames) {
    if (!usable(frame.grid, frame.values.size())) return bad();
    if (!all_finite(frame.values.data(), frame.values.size())) return not_finite();
    frames.push_back(sampled_scalar(std::move(frame)));
  }
  if (frames.empty()) return refused(spec, "no frames were read; give its files.");
  if (!data.vectors.empty() && !data.frames.frames.empty())
    return refused(spec, "it has both scalar and vector frames; give one kind.");
  return frames;
}

Result<Motion> motion_of(const VolumeSpec& spec, const std::string& name, const MotionData& data,
                         const FrameData& frame) {
  Motion motion{name, {}};
  if (!data.confidences.empty() && data.confidences.size() != data.fields.size())
    return refused(spec, "its motion \"" + name + "\" has " + std::to_string(data.fields.size()) +
                             " fields but " + std::to_string(data.confidences.size()) +
                             " confidences; give none or one for each.");
  for (size_t step = 0; step < data.fields.size(); ++step) {
    const Field& field = data.fields[step];
    const auto wrong = [&](const std::string& what) {
      return refused(spec,
                     "field " + std::to_string(step) + " of its motion \"" + name + "\" " + what);
    };
    if (field.u_mm.empty()) {
      motion.steps.push_back(nullptr);
      continue;
    }
    if (!usable(field.grid, field.u_mm.size()))
      return wrong("has more or fewer vectors than its grid says.");
    if (!meets(field.grid, frame))
      return wrong("lies somewhere else in space than the frames; is it another patient's?");
    const Confidence* confidence = nullptr;
    if (!data.confidences.empty() && !data.confidences[step].values.empty()) {
      confidence = &data.confidences[step];
      if (!usable(confidence->grid, confidence->values.size()))
        return wrong("has a confidence with more or fewer values than its grid says.");
    }
    motion.steps.push_back(MotionMap::of(field, confidence));
  }
  return motion;
}

/// The same motion with so many frames a second in the mean.
void set_pace(TimeBasis& basis, double frames_per_second) {
  const double mean_s = basis.times_s.back() / double(basis.times_s.size() - 1);
  const double factor = 1.0 / (frames_per_second * mean_s);
  for (double& time_s : basis.times_s) time_s *= factor;
  basis.cycle_s *= factor;
}

/// Whether at least half of the border of `inner` lies against `outer`. Of the same grid.
bool encloses(const Mask& outer, const Mask& inner) {
  const glm::ivec3 n = inner.grid.size;
  const size_t row = size_t(n.x), slice = row * size_t(n.y);
  size_t faces = 0, against = 0, v = 0;
  for (int k = 0; k < n.z; ++k)
    for (int j = 0; j < n.y; ++j)
      for (int i = 0; i < n.x; ++i, ++v) {
        if (!inner.values[v]) continue;
        const auto look = [&](bool is_there, size_t to) {
          if (is_there && inner.values[to]) return;
          ++faces;
          against += is_there && outer.values[to];
        };
        look(i > 0, v - 1), look(i + 1 < n.x, v + 1);
        look(j > 0, v - row), look(j + 1 < n.y, v + row);
        look(k > 0, v - slice), look(k + 1 < n.z, v + slice);
      }
  return faces > 0 && 2 * against >= faces;
}

/// Adds to each segment those that it encloses, and what these enclose.
void fill_enclosed(std::vector<SegmentData>& data) {
  const auto alike = [](const SegmentData& a, const SegmentData& b) {
    if (a.masks.size() != b.masks.size()) return false;
    for (size_t k = 0; k < a.masks.size(); ++k)
      if (!same_geometry(a.masks[k].grid, b.masks[k].grid) ||
          a.masks[k].values.size() != a.masks[k].grid.count() ||
          b.masks[k].values.size() != a.masks[k].grid.count())
        return false;
    return !a.masks.empty();
  };
  // From the file's labels: what has been filled must not make others enclosed.
  std::vector<std::vector<size_t>> inside(data.size());
  for (size_t outer = 0; outer < data.size(); ++outer)
    for (size_t inner = 0; inner < data.size(); ++inner)
      if (outer != inner && alike(data[outer], data[inner]) &&
          encloses(data[outer].masks.front(), data[inner].masks.front()))
        inside[outer].push_back(inner);
  for (size_t outer = 0; outer < data.size(); ++outer) {
    std::vector<size_t> filled = inside[outer];
    for (size_t next = 0; next < filled.size(); ++next)
      for (const size_t deeper : inside[filled[next]])
        if (deeper != outer && std::find(filled.begin(), filled.end(), deeper) == filled.end())
          filled.push_back(deeper);
    for (const size_t inner : filled)
      for (size_t k = 0; k < data[outer].masks.size(); ++k) {
        std::vector<uint8_t>& to = data[outer].masks[k].values;
        const std::vector<uint8_t>& from = data[inner].masks[k].values;
        for (size_t v = 0; v < to.size(); ++v) to[v] = to[v] || from[v];
      }
  }
}

/// Segments as smooth signed distances. The masks are used up.
Status add_segments(const VolumeSpec& spec, std::vector<SegmentData>& data, MovingVolume& volume) {
  const size_t frames = volume.frames.size();
  if (spec.segments.frame >= frames)
    return refused(spec, "its segmentation is of frame " + std::to_string(spec.segments.frame) +
                             ", but its frames are 0 to " + std::to_string(frames - 1) + ".");
  volume.segments_frame = spec.segments.frame;
  if (spec.segments.one_body) fill_enclosed(data);
  for (SegmentData& of : data) {
    const auto wrong = [&](const std::string& what) {
      return refused(spec, "its segment \"" + of.name + "\" " + what);
    };
    if (of.masks.size() != 1 && of.masks.size() != frames)
      return wrong("has " + std::to_string(of.masks.size()) + " label maps for " +
                   std::to_string(frames) + " frames; give one for each, or one alone.");
    Segment segment{of.name, of.colour, {}, of.shown};
    for (Mask& mask : of.masks) {
      if (!usable(mask.grid, mask.values.size()))
        return wrong("has more or fewer labels than its grid says.");
      if (!meets(mask.grid, *volume.frames.front()))
        return wrong("lies somewhere else in space than the frames; is it another patient's?");
      if (std::find_if(mask.values.begin(), mask.values.end(),
                       [](uint8_t value) { return value != 0; }) == mask.values.end())
        return wrong("has no voxel in one of its label maps.");
      segment.distance_mm.push_back(sampled_scalar(signed_distance(mask)));
      mask = {};
    }
    volume.segments.push_back(std::move(segment));
  }
  return Nothing{};
}

/// A grid like that of samples, with so much more around it.
Grid grid_around(const GridPlace& place, double margin_m) {
  const glm::dmat3 step_m = glm::inverse(place.index_from_volume);
  Grid grid;
  glm::ivec3 more;
  for (int a = 0; a < 3; ++a) {
    const glm::dvec3 step_mm = lps_from_volume(step_m[a]);
    grid.spacing_mm[a] = glm::length(step_mm);
    grid.direction[a] = step_mm / grid.spacing_mm[a];
    more[a] = int(std::ceil(1e3 * margin_m / grid.spacing_mm[a]));
  }
  grid.size = place.size + 2 * more;
  grid.origin_mm = lps_from_volume(step_m * (-glm::dvec3(more) - place.offset));
  return grid;
}

/// A distance of another frame where its material is in the reference frame.
std::shared_ptr<const FrameData> carried_back(const FrameData& distance, const SequenceMap& map,
                                              const TimeWeights& time) {
  Volume at_reference{grid_around(*distance.samples().place, map.largest_u_m()), {}};
  at_reference.values.resize(at_reference.grid.count());
  const Grid& grid = at_reference.grid;
  parallel_ranges(grid.size.z, 200.0 * grid.size.x * grid.size.y, [&](int begin, int end) {
    SequenceSnapshot then(map, time);
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i) {
          const glm::dvec3 x = volume_from_lps(grid.lps_from_index({i, j, k}));
          at_reference.values[grid.offset(i, j, k)] =
              float(distance.scalar(x + then.displacement(x)));
        }
  });
  return sampled_scalar(std::move(at_reference));
}

/// The mean of the middle half of all frames' values (the interquartile mean), each read where the
/// material of the reference frame is at its time: one frame that is wrong does not count.
std::shared_ptr<const FrameData> mean_of(
    const std::vector<std::shared_ptr<const FrameData>>& frames, const SequenceMap& map) {
  const FrameData& reference = *frames[map.reference()];
  Volume mean{grid_around(*reference.samples().place, 0.0), {}};
  mean.values.resize(mean.grid.count());
  const Grid& grid = mean.grid;
  parallel_ranges(grid.size.z, 200.0 * double(frames.size()) * grid.size.x * grid.size.y,
                  [&](int begin, int end) {
                    std::vector<SequenceSnapshot> at_frame;
                    for (size_t k = 0; k < frames.size(); ++k)
                      at_frame.emplace_back(map, map.basis().at(map.basis().times_s[k]));
                    std::vector<double> values;
                    for (int k = begin; k < end; ++k)
                      for (int j = 0; j < grid.size.y; ++j)
                        for (int i = 0; i < grid.size.x; ++i) {
                          const glm::dvec3 x = volume_from_lps(grid.lps_from_index({i, j, k}));
                          values.clear();
                          for (size_t f = 0; f < frames.size(); ++f) {
                            const glm::dvec3 y = x + at_frame[f].displacement(x);
                            // Frames in which it has left the data do not count.
                            if (glm::all(glm::greaterThanEqual(y, frames[f]->low_m())) &&
                                glm::all(glm::lessThanEqual(y, frames[f]->high_m())))
                              values.push_back(frames[f]->scalar(y));
                          }
                          if (values.empty()) values.push_back(reference.scalar(x));
                          std::sort(values.begin(), values.end());
                          const size_t beside = values.size() / 4;
                          double sum = 0.0;
                          for (size_t n = beside; n < values.size() - beside; ++n) sum += values[n];
                          mean.values[grid.offset(i, j, k)] =
                              float(sum / double(values.size() - 2 * beside));
                        }
                  });
  return sampled_scalar(std::move(mean));
}

Result<MovingVolume> checked(MovingVolume volume) {
  const Status status = check(volume);
  if (!status) return status.error();
  return volume;
}

/// A phantom: how many frames it has, a frame by its formula, all of them sampled without noise,
/// and its true motion on a grid.
struct Phantom {
  int frames;
  std::shared_ptr<const FrameData> (*exact)(int frame, int frames, uint32_t seed, double voxel_mm);
  Sequence (*sampled)(const Grid& grid, int frames, uint32_t seed, double noise);
  Field (*truth)(const Grid& grid, int from_frame, int to_frame, int frames);
  /// Spacing of the motion's samples, mm: fine enough that trilinear interpolation is right to a
  /// hundredth of a millimetre.
  double motion_mm;
};
constexpr Phantom kShell{kShellFrames, analytic_shell, shell_phantom, shell_truth, 1.0};
constexpr Phantom kHeart{kHeartFrames, analytic_heart, heart_phantom, heart_truth, 2.0};

MovingVolume made(const VolumeSpec& spec, const Phantom& phantom, bool exact) {
  Sequence sequence;
  MovingVolume volume;
  volume.name = spec.name;
  if (exact) {
    for (int k = 0; k < phantom.frames; ++k) {
      volume.frames.push_back(phantom.exact(k, phantom.frames, 1, 1.0));
      sequence.times_s.push_back(double(k) / phantom.frames);
    }
  } else {
    sequence = phantom.sampled(heart_grid(kSamples), phantom.frames, 1, 0.0);
    for (Volume& frame : sequence.frames) volume.frames.push_back(sampled_scalar(std::move(frame)));
  }
  volume.times = times_of(spec, sequence, volume.frames.size());
  const Grid grid = heart_grid(int(kSamples / phantom.motion_mm));
  Motion motion{"data", {}};
  for (int k = 0; k < volume.times.steps(); ++k)
    motion.steps.push_back(
        MotionMap::of(phantom.truth(grid, k, (k + 1) % phantom.frames, phantom.frames)));
  volume.motions.push_back(std::move(motion));
  return volume;
}

/// Of the reference frame and the motion that is told from it.
Result<MovingVolume> carried_of(const VolumeSpec& spec, VolumeData data) {
  SequenceMotion& motion = *data.whole;
  if (!std::isfinite(spec.frames_per_second))
    return refused(spec, "its frames per second are not finite.");
  auto frames = frames_of(spec, data);
  if (!frames) return frames.error();
  const bool all = spec.values == CarriedValues::kMean;
  if (motion.frames() < 2 || frames->size() != (all ? motion.frames() : 1) ||
      motion.terms.empty() || motion.terms.size() != motion.basis.terms())
    return refused(spec,
                   "one motion for all its times needs its terms and its reference frame, "
                   "and all frames for the mean of their values.");
  if (!meets(motion.terms.front().grid, *frames->front()))
    return refused(spec,
                   "its motion lies somewhere else in space than the frames; is it another "
                   "patient's?");
  if (spec.frames_per_second > 0.0) set_pace(motion.basis, spec.frames_per_second);
  if (spec.cycle_s > 0.0) set_length(motion.basis.times_s, motion.basis.cycle_s, spec.cycle_s);
  MovingVolume own;
  own.name = spec.name;
  own.times = {motion.basis.times_s, motion.basis.cycle_s,
               spec.frames_per_second <= 0.0 && spec.cycle_s <= 0.0 && !data.frames.times_known &&
                   are_assumed_times(motion.basis.times_s)};
  if (all)
    own.frames = std::move(*frames);
  else
    own.frames.assign(motion.frames(), frames->front());  // only the reference's is asked for
  if (const Status added = add_segments(spec, data.segments, own); !added) return added.error();
  return carried(own, motion, spec.values.value_or(CarriedValues::kReference));
}

/// Samples in one metre along each axis of a grid.
glm::dvec3 samples_per_m(const GridPlace& grid) {
  const glm::dmat3 rows = glm::transpose(grid.index_from_volume);
  return {glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2])};
}

/// Three edges with the four digits that a person needs to write them.
std::string box_text(glm::dvec3 box_m) {
  char text[96];
  std::snprintf(text, sizeof text, "%.4g %.4g %.4g", box_m.x, box_m.y, box_m.z);
  return text;
}

/// From volume space into a box around the origin along whose axes the grid's lie.
glm::dmat4 box_from_volume(const GridPlace& grid, glm::dvec3 box_m) {
  // A sample's centre is index + 1/2 of an edge of size samples.
  const glm::dvec3 edge = box_m / glm::dvec3(grid.size);
  glm::dmat4 m(1.0);
  for (int a = 0; a < 3; ++a) m[a] = glm::dvec4(edge * grid.index_from_volume[a], 0.0);
  m[3] = glm::dvec4(edge * (grid.offset + 0.5) - 0.5 * box_m, 1.0);
  return m;
}

/// The potential of the spec's charges.
Result<MovingVolume> charged(const VolumeSpec& spec) {
  if (spec.charges.empty()) return refused(spec, "it has no charges; give at least one.");
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const PointCharge& charge : spec.charges) {
    const double sum = glm::dot(charge.position_m, glm::dvec3(1.0)) + charge.strength_v_m;
    if (!std::isfinite(sum) || !(charge.softness_m > 0.0) || !std::isfinite(charge.softness_m))
      return refused(spec,
                     "a charge has a place or strength that is not finite, or a softness that is "
                     "not above 0; correct it.");
    low = glm::min(low, charge.position_m - 5.0 * charge.softness_m);
    high = glm::max(high, charge.position_m + 5.0 * charge.softness_m);
  }
  if (spec.box_m) {
    low = -0.5 * *spec.box_m;
    high = 0.5 * *spec.box_m;
  }
  MovingVolume volume;
  volume.name = spec.name;
  volume.times = {{0.0}, 0.0};
  volume.frames = {point_charges(spec.charges, low, high)};
  return checked(std::move(volume));
}

}  // namespace

Result<MovingVolume> build(const VolumeSpec& spec, VolumeData data) {
  if (data.whole) return carried_of(spec, std::move(data));
  if (data.motions.size() != spec.motions.size())
    return refused(spec, "it names " + std::to_string(spec.motions.size()) + " motions but " +
                             std::to_string(data.motions.size()) + " were read.");
  if (!std::isfinite(spec.frames_per_second))
    return refused(spec, "its frames per second are not finite.");
  auto frames = frames_of(spec, data);
  if (!frames) return frames.error();
  MovingVolume volume;
  volume.name = spec.name;
  volume.frames = std::move(*frames);
  volume.times = times_of(spec, data.frames, volume.frames.size());
  for (size_t m = 0; m < spec.motions.size(); ++m) {
    auto motion = motion_of(spec, spec.motions[m].name, data.motions[m], *volume.frames[0]);
    if (!motion) return motion.error();
    volume.motions.push_back(std::move(*motion));
  }
  if (const Status added = add_segments(spec, data.segments, volume); !added) return added.error();
  return checked(std::move(volume));
}

Result<MovingVolume> build(const VolumeSpec& spec) {
  if (!std::isfinite(spec.frames_per_second))
    return refused(spec, "its frames per second are not finite.");
  if (spec.source == "heart" || spec.source == "heart-exact")
    return checked(made(spec, kHeart, spec.source == "heart-exact"));
  if (spec.source == "shell" || spec.source == "shell-exact")
    return checked(made(spec, kShell, spec.source == "shell-exact"));
  if (spec.source == "charges") return charged(spec);
  if (spec.source == "molecule") {
    MovingVolume volume;
    volume.name = spec.name;
    volume.times.times_s = {0.0};
    volume.frames = {dichloroethane()};
    return checked(std::move(volume));
  }
  return refused(spec, "there is no synthetic data called \"" + spec.source +
                           "\"; there are heart, heart-exact, shell, shell-exact, "
                           "molecule and charges.");
}

Result<MovingVolume> carried(const MovingVolume& own, const SequenceMotion& motion,
                             CarriedValues values) {
  if (motion.frames() != own.frames.size() || motion.reference >= own.frames.size())
    return Error{ErrorKind::kBadInput,
                 "The volume \"" + own.name + "\" can not be used: its motion is that of " +
                     std::to_string(motion.frames()) + " frames with reference frame " +
                     std::to_string(motion.reference) + ", but it has " +
                     std::to_string(own.frames.size()) + " frames."};
  MovingVolume volume;
  volume.name = own.name;
  volume.times = {motion.basis.times_s, motion.basis.cycle_s,
                  own.times.assumed && are_assumed_times(motion.basis.times_s)};
  volume.whole = SequenceMap::of(motion);
  volume.frames = {values == CarriedValues::kMean ? mean_of(own.frames, *volume.whole)
                                                  : own.frames[motion.reference]};
  const TimeWeights then = motion.basis.at(motion.basis.times_s[own.segments_frame]);
  for (const Segment& segment : own.segments) {
    std::shared_ptr<const FrameData> distance;
    if (segment.distance_mm.size() == own.frames.size())
      distance = segment.distance_mm[motion.reference];
    else if (own.segments_frame == motion.reference)
      distance = segment.distance_mm.front();
    else
      distance = carried_back(*segment.distance_mm.front(), *volume.whole, then);
    volume.segments.push_back({segment.name, segment.colour, {distance}, segment.shown});
  }
  return checked(std::move(volume));
}

Result<MovingVolume> standing_at(const MovingVolume& own, size_t k) {
  SequenceMotion none;
  none.reference = k;
  none.basis = {own.times.times_s, own.times.cycle_s, 0};
  Grid anywhere;
  anywhere.size = glm::ivec3(1);
  none.terms.assign(own.times.times_s.size(), still_field(anywhere));
  return carried(own, none);
}

glm::dvec3 filled_box(const VolumeSpec& spec, const MovingVolume& volume) {
  constexpr double kThreeDigits = 0.0101;  // 100.5 to 99.5
  constexpr double kAlong = 1e-6;          // a share of an axis that is only rounding
  glm::dvec3 box = *spec.box_m;
  const GridPlace* grid = volume.frames.empty() ? nullptr : volume.frames.front()->samples().place;
  if (!grid || split(matrix(spec.transform) * box_from_volume(*grid, box))) return box;
  // How much each axis of the grid is stretched. Axes of which both lie along one of volume space
  // have to be stretched alike.
  const glm::dvec3 per_m = samples_per_m(*grid);
  const glm::dvec3 stretch = spec.transform.scale * box / glm::dvec3(grid->size) * per_m;
  const auto oblique = [&](int a, int b) {
    for (int v = 0; v < 3; ++v)
      if (std::abs(grid->index_from_volume[v][a] / per_m[a]) > kAlong &&
          std::abs(grid->index_from_volume[v][b] / per_m[b]) > kAlong)
        return true;
    return false;
  };
  std::vector<int> tied;
  for (int a = 0; a < 3; ++a)
    if (oblique(a, (a + 1) % 3) || oblique(a, (a + 2) % 3)) tied.push_back(a);
  if (tied.empty()) return box;
  std::sort(tied.begin(), tied.end(), [&](int a, int b) { return stretch[a] < stretch[b]; });
  const double least = stretch[tied.front()], most = stretch[tied.back()];
  const bool fits = most - least <= kThreeDigits * least;
  if (!fits && !spec.box_assumed) return box;
  double common = least;
  if (fits) common = tied.size() == 3 ? stretch[tied[1]] : 0.5 * (least + most);
  for (const int a : tied) box[a] *= common / stretch[a];
  return box;
}

double scale_to_reach(const FrameData& frame, double reach_m) {
  const glm::dvec3 size = frame.high_m() - frame.low_m();
  // Seven tenths of the reach on either side: corners extend further, and the hand needs free
  // space.
  const double room = 2.0 * 0.7 * reach_m;
  const double longest = std::max({size.x, size.y, size.z});
  return room > 0.0 && longest > room ? room / longest : 1.0;
}

Result<Transform> start_transform(const VolumeSpec& spec, const MovingVolume& volume) {
  Transform transform = spec.transform;
  if (spec.box_m && spec.source.empty() && !volume.frames.empty()) {
    const GridPlace* grid = volume.frames.front()->samples().place;
    if (!grid)
      return refused(spec, "its data have no grid that could fill a box; leave the box out.");
    const auto filled = split(matrix(transform) * box_from_volume(*grid, filled_box(spec, volume)));
    if (filled) return filled;
    // Any multiple of its true size can be filled.
    const glm::dvec3 scale = transform.scale;
    const glm::dvec3 fits = glm::dvec3(grid->size) / samples_per_m(*grid) *
                            (std::max({scale.x, scale.y, scale.z}) / scale);
    return refused(spec, "its grid lies obliquely, and a box of " + box_text(*spec.box_m) +
                             " m would shear it; give the box (in X3D: dimensions) the "
                             "proportions of its edges, for example " +
                             box_text(fits) + ".");
  }
  if (spec.centred && spec.source.empty() && !volume.frames.empty()) {
    const FrameData& first = *volume.frames.front();
    const glm::dvec3 middle = 0.5 * (first.low_m() + first.high_m());
    transform.translation_m -= transform.rotation * (transform.scale * middle);
  }
  return transform;
}

Status place_by_box(VolumeSpec& spec, const MovingVolume& volume,
                    const Transform& world_from_volume) {
  const GridPlace* grid = volume.frames.empty() ? nullptr : volume.frames.front()->samples().place;
  if (!grid) return refused(spec, "its data have no grid whose box could be said.");
  // The columns of the inverse are the grid's steps, volume space.
  const glm::dmat3 steps = world_from_volume.linear() * glm::inverse(grid->index_from_volume);
  glm::dvec3 box;
  for (int a = 0; a < 3; ++a) box[a] = glm::length(steps[a]) * grid->size[a];
  const auto world_from_box =
      split(matrix(world_from_volume) * glm::inverse(box_from_volume(*grid, box)));
  if (!world_from_box)
    return refused(spec,
                   "its transform stretches it along other axes than its grid's; give the same "
                   "scale along all axes.");
  spec.box_m = box;
  spec.transform = *world_from_box;
  return Nothing{};
}

}  // namespace palpate
