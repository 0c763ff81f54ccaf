#include "module/session/stream_tube.h"

#include <algorithm>
#include <cmath>

#include "module/haptics/proxy/back_track.h"
#include "module/haptics/proxy/local_reader.h"
#include "module/scene/cycle_closing.h"
#include "module/scene/field_line.h"

namespace palpate {
namespace {

constexpr int kMostSteps = 600;  // on each side of the seed
// Step length: half a detail keeps the error far below a thousandth of it; for formulas, which have
// no detail, the line must not look like a chain of straight pieces.
constexpr double kStepDetails = 0.5, kStepsAcross = 200.0;
constexpr double kLeastMove = 0.02;    // of a detail in one frame: slower material has no direction
constexpr double kDifference = 0.005;  // of a frame, for the velocity of one motion for all times

const MotionMap* step_of(const MovingVolume& data, int frame) {
  if (data.motions.empty() || frame < 0 || frame >= int(data.motions[0].steps.size()))
    return nullptr;
  return data.motions[0].steps[size_t(frame)].get();
}

/// The closing error of a cycle for the material at x in the last frame.
glm::dvec3 closing_of(const MovingVolume& data, int frame, glm::dvec3 x) {
  const bool closes = data.times.cyclic() && !data.motions.empty() && frame > 0 &&
                      frame + 1 == int(data.motions[0].steps.size());
  return closes ? closing_forward(data.motions[0].steps, x) : glm::dvec3(0.0);
}

/// Seconds from the frame to the next one.
double step_s(const FrameTimes& times, int frame) {
  const size_t k = size_t(frame);
  if (k + 1 < times.times_s.size()) return times.times_s[k + 1] - times.times_s[k];
  if (times.cyclic()) return times.cycle_s - times.times_s.back();
  return times.times_s.size() > 1 ? times.times_s[k] - times.times_s[k - 1] : 1.0;
}

/// Finds the material that is at `target` at the pointer: its place in the data frame, or in the
/// reference frame of one motion for all times. Empty if the motion can not be inverted there.
std::optional<glm::dvec3> material_at(const MovingVolume& data, FramePointer pointer,
                                      glm::dvec3 target) {
  if (data.whole) {
    SequenceSnapshot now(*data.whole, data.whole->basis().at(pointer.frame, pointer.phase));
    const BackTrack found = back_track(now, target, target);
    if (!found.ok) return std::nullopt;
    return found.x_m;
  }
  const MotionMap* map = step_of(data, pointer.frame);
  if (!map || pointer.phase == 0.0) return target;
  BackTrack found = back_track(*map, pointer.phase, target, target);
  if (!found.ok) return std::nullopt;
  // The closing error depends on the material, which is only known now: solve once more with it.
  const glm::dvec3 closing = closing_of(data, pointer.frame, found.x_m);
  if (closing != glm::dvec3(0.0))
    found = back_track(*map, pointer.phase, target, found.x_m, closing);
  if (!found.ok) return std::nullopt;
  return found.x_m;
}

/// The present place of the material of a data frame; the pointer is in that frame.
glm::dvec3 place_at(const MovingVolume& data, FramePointer pointer, glm::dvec3 x) {
  if (data.whole)
    return x + data.whole->displacement(x, data.whole->basis().at(pointer.frame, pointer.phase));
  const MotionMap* map = step_of(data, pointer.frame);
  if (!map || pointer.phase == 0.0) return x;
  return x + pointer.phase * (map->displacement(x) + closing_of(data, pointer.frame, x));
}

/// Transforms a vector from the material's present place back to the data frame: zero in a fold.
glm::dvec3 taken_back(glm::dvec3 v, const glm::dmat3& stretch) {
  return glm::determinant(stretch) > 0.0 ? glm::inverse(stretch) * v : glm::dvec3(0.0);
}

/// A field in the data frame at one instant; the motion maps its lines to the lines of the field
/// that is felt.
class FrozenField {
 public:
  FrozenField(const MovingVolume& data, bool blend_values, TubeField field, FramePointer pointer)
      : data_(data), field_(field), pointer_(pointer) {
    const size_t frames = data.frames.size();
    const size_t of = data.whole ? 0 : std::min(size_t(pointer.frame), frames - 1);
    frame_ = data.frames[of].get();
    if (blend_values && !data.whole && pointer.phase > 0.0)
      next_ = data.frames[(of + 1) % frames].get();
    mode_.vector = field == TubeField::kCurl       ? VectorProperty::kCurl
                   : field == TubeField::kGradient ? VectorProperty::kGradient
                                                   : VectorProperty::kVector;
    if (data.whole && field == TubeField::kVelocity) {
      const TimeBasis& basis = data.whole->basis();
      // The weights of the terms half a difference before and after; at the ends of data that do
      // not repeat only on the inner side.
      const double frame_s = step_s(data.times, pointer.frame), h_s = kDifference * frame_s;
      const double now_s = data.times.times_s[size_t(pointer.frame)] + pointer.phase * frame_s;
      double from_s = now_s - h_s, to_s = now_s + h_s;
      if (!data.times.cyclic()) {
        from_s = std::max(from_s, 0.0);
        to_s = std::min(to_s, data.times.length_s());
      }
      between_s_ = to_s - from_s;
      before_.emplace(*data.whole, basis.at(from_s));
      after_.emplace(*data.whole, basis.at(to_s));
      now_.emplace(*data.whole, basis.at(pointer.frame, pointer.phase));
    }
  }

  const FrameData& frame() const { return *frame_; }
  /// Below this length there is no direction.
  double least_length() const {
    return field_ == TubeField::kVelocity
               ? kLeastMove * frame_->detail_m() / step_s(data_.times, pointer_.frame)
               : 0.0;
  }

  /// The direction that the tube follows, in the data frame.
  glm::dvec3 in_frame(glm::dvec3 x) {
    if (field_ != TubeField::kVelocity) return read(x);
    if (data_.whole) return taken_back(velocity(x), glm::dmat3(1.0) + now_->sample(x).jacobian);
    const MotionMap* map = step_of(data_, pointer_.frame);
    if (!map) return glm::dvec3(0.0);
    const MotionSample sample = map->sample(x);
    return taken_back(sample.u_m / step_s(data_.times, pointer_.frame),
                      glm::dmat3(1.0) + pointer_.phase * sample.jacobian);
  }

  /// Length of the vector at the material's present place.
  double length(glm::dvec3 x) {
    if (field_ != TubeField::kVelocity) return glm::length(read(x));
    if (data_.whole) return glm::length(velocity(x));
    const MotionMap* map = step_of(data_, pointer_.frame);
    return map ? glm::length(map->displacement(x)) / step_s(data_.times, pointer_.frame) : 0.0;
  }

 private:
  glm::dvec3 velocity(glm::dvec3 x) {
    return between_s_ > 0.0 ? (after_->displacement(x) - before_->displacement(x)) / between_s_
                            : glm::dvec3(0.0);
  }
  glm::dvec3 read(glm::dvec3 x) {
    if (!next_) return vector_of(*frame_, mode_.vector, x);
    const MotionMap* map = step_of(data_, pointer_.frame);
    const MotionSample at =
        map ? map->sample(x) : MotionSample{glm::dvec3(0.0), glm::dmat3(0.0), 1.0};
    return BlendedReader(*frame_, *next_, mode_, x, x + at.u_m, at.jacobian, pointer_.phase, read_,
                         read_next_)
        .vector();
  }

  const MovingVolume& data_;
  TubeField field_;
  FramePointer pointer_;
  const FrameData* frame_ = nullptr;
  const FrameData* next_ = nullptr;  ///< for blending, or null
  ModeSpec mode_;
  LastRead read_, read_next_;
  std::optional<SequenceSnapshot> before_, now_, after_;
  double between_s_ = 0.0;
};

bool is_inside(const FrameData& frame, glm::dvec3 x) {
  return glm::all(glm::greaterThan(x, frame.low_m())) && glm::all(glm::lessThan(x, frame.high_m()));
}

}  // namespace

const char* word(TubeField field) noexcept {
  switch (field) {
    case TubeField::kVectors:
      return "vectors";
    case TubeField::kGradient:
      return "gradient";
    case TubeField::kCurl:
      return "curl";
    case TubeField::kVelocity:
      return "velocity";
  }
  return "";
}

const char* unit(TubeField field) noexcept {
  switch (field) {
    case TubeField::kVectors:
      return "data";
    case TubeField::kGradient:
    case TubeField::kCurl:
      return "data per m";
    case TubeField::kVelocity:
      return "m/s";
  }
  return "";
}

std::optional<TubeField> tube_field(const Scene& scene, size_t volume) {
  const SceneVolume& of = scene.volumes[volume];
  const bool vectors = of.data->frames.front()->is_vector();
  for (const SceneMode& mode : scene.modes) {
    const std::string& kind = mode.spec.kind;
    if (mode.spec.volume != of.spec.name || mode.segment >= 0) continue;
    if (kind != "follow" && kind != "front" && kind != "vector-force") continue;
    if (mode.spec.vector == VectorProperty::kCurl) return TubeField::kCurl;
    return vectors && mode.spec.vector == VectorProperty::kVector ? TubeField::kVectors
                                                                  : TubeField::kGradient;
  }
  if (vectors) return TubeField::kVectors;
  if (of.spec.appearance.tubes.value_or(false)) return TubeField::kGradient;
  if (!of.data->is_still() && (of.data->whole || !of.data->motions.empty()))
    return TubeField::kVelocity;
  return std::nullopt;
}

Result<StreamTube> StreamTube::release(std::shared_ptr<const MovingVolume> data, bool blend_values,
                                       TubeField field, FramePointer pointer, glm::dvec3 seed_m) {
  const auto material = material_at(*data, pointer, seed_m);
  if (!material)
    return Error{ErrorKind::kBadInput, "the motion can not be inverted where the hand is"};
  FrozenField frozen(*data, blend_values, field, pointer);
  if (!is_inside(frozen.frame(), *material))
    return Error{ErrorKind::kBadInput, "the hand is outside of the data"};
  LineOptions options;
  options.low_m = frozen.frame().low_m();
  options.high_m = frozen.frame().high_m();
  options.step_m = std::min(kStepDetails * frozen.frame().detail_m(),
                            glm::distance(options.low_m, options.high_m) / kStepsAcross);
  options.most_steps = kMostSteps;
  options.least_length = frozen.least_length();
  options.closes = true;
  const auto vector = [&](glm::dvec3 x) { return frozen.in_frame(x); };
  const FieldLine with = field_line(vector, *material, 1.0, options);
  std::vector<glm::dvec3> places;
  StreamTube tube;
  if (!with.closed) {
    // From the upstream end, through the seed, to the downstream end.
    const FieldLine against = field_line(vector, *material, -1.0, options);
    places.assign(against.places_m.rbegin(), against.places_m.rend() - 1);
    tube.seed_ = places.size();
  }
  places.insert(places.end(), with.places_m.begin(), with.places_m.end());
  if (places.size() < 2)
    return Error{ErrorKind::kBadInput, field == TubeField::kVelocity
                                           ? "the material stands still there at this time"
                                           : "there is no direction to follow there"};
  tube.data_ = std::move(data);
  tube.field_ = field;
  tube.released_ = pointer;
  tube.closed_ = with.closed;
  for (const glm::dvec3& x : places) {
    tube.released_m_.push_back(place_at(*tube.data_, pointer, x));
    tube.lengths_.push_back(frozen.length(x));
  }
  if (!tube.carry(pointer, places))
    return Error{ErrorKind::kBadInput, "the motion can not be inverted where the hand is"};
  return tube;
}

/// Fills material_m_ from the material's places in the pointer's frame: on to the last frame and,
/// in a cycle, round; back to the first one if it does not repeat. Where no way back is found the
/// tube ends.
bool StreamTube::carry(FramePointer pointer, const std::vector<glm::dvec3>& places_m) {
  const MovingVolume& data = *data_;
  const bool moves = !data.is_still() && !data.whole && !data.motions.empty();
  const int frames = int(data.frames.size());
  if (!moves || pointer.frame >= frames) {
    material_m_.assign(1, places_m);
    return true;
  }
  material_m_.assign(size_t(frames), {});
  material_m_[size_t(pointer.frame)] = places_m;
  const auto enter = [&](int from, int to) {
    const MotionMap* map = step_of(data, from);
    for (const glm::dvec3& x : material_m_[size_t(from)])
      material_m_[size_t(to)].push_back(map ? x + map->displacement(x) + closing_of(data, from, x)
                                            : x);
  };
  for (int frame = pointer.frame; frame + 1 < frames; ++frame) enter(frame, frame + 1);
  if (data.times.cyclic()) {
    for (int n = 0; n < pointer.frame; ++n) enter(n == 0 ? frames - 1 : n - 1, n);
    return true;
  }
  size_t begin = 0, end = places_m.size();
  for (int frame = pointer.frame - 1; frame >= 0; --frame) {
    const MotionMap* map = step_of(data, frame);
    const std::vector<glm::dvec3>& later = material_m_[size_t(frame) + 1];
    std::vector<glm::dvec3> here(later);
    for (size_t k = begin; map && k < end; ++k) {
      const glm::dvec3 start = later[k] - map->displacement(later[k]);
      const BackTrack found = back_track(*map, 1.0, later[k], start);
      here[k] = found.x_m;
      if (found.ok) continue;
      if (k == seed_) return false;
      if (k < seed_)
        begin = k + 1;
      else
        end = k;
    }
    material_m_[size_t(frame)] = std::move(here);
  }
  keep(begin, end);
  return end - begin > 1;
}

void StreamTube::keep(size_t begin, size_t end) {
  const auto cut = [&](auto& all) {
    all.erase(all.begin() + ptrdiff_t(end), all.end());
    all.erase(all.begin(), all.begin() + ptrdiff_t(begin));
  };
  closed_ = closed_ && begin == 0 && end == released_m_.size();
  cut(released_m_);
  cut(lengths_);
  for (std::vector<glm::dvec3>& places : material_m_) cut(places);
  seed_ -= begin;
}

std::optional<StreamTube> StreamTube::moved_to(std::shared_ptr<const MovingVolume> data,
                                               FramePointer pointer) const {
  StreamTube tube = *this;
  tube.data_ = std::move(data);
  const std::vector<glm::dvec3> now = places(pointer);
  std::vector<glm::dvec3> material;
  size_t begin = 0, end = now.size();
  for (size_t k = 0; k < now.size(); ++k) {
    const auto found = material_at(*tube.data_, pointer, now[k]);
    material.push_back(found.value_or(now[k]));
    if (found || k >= end) continue;
    if (k == seed_) return std::nullopt;
    if (k < seed_)
      begin = k + 1;
    else
      end = k;
  }
  // Cut before the material is carried, so that all lists have the same length.
  tube.material_m_.assign(1, material);
  tube.keep(begin, end);
  material = tube.material_m_.front();
  if (material.size() < 2 || !tube.carry(pointer, material)) return std::nullopt;
  return tube;
}

std::vector<glm::dvec3> StreamTube::places(FramePointer pointer) const {
  if (data_->whole) {
    SequenceSnapshot now(*data_->whole, data_->whole->basis().at(pointer.frame, pointer.phase));
    std::vector<glm::dvec3> places = material_m_.front();
    for (glm::dvec3& x : places) x += now.displacement(x);
    return places;
  }
  if (material_m_.size() == 1) return material_m_.front();
  const size_t frame = std::min(size_t(pointer.frame), material_m_.size() - 1);
  std::vector<glm::dvec3> places = material_m_[frame];
  const size_t next = (frame + 1) % material_m_.size();
  if (pointer.phase == 0.0 || (next == 0 && !data_->times.cyclic())) return places;
  // x + g u(x) is the present place; x + u(x), with a cycle's closing error, the place in the next
  // frame.
  for (size_t k = 0; k < places.size(); ++k)
    places[k] = glm::mix(places[k], material_m_[next][k], pointer.phase);
  return places;
}

}  // namespace palpate
