#include "module/session/scene_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "module/scene/data_box.h"
#include "module/session/moved_volume.h"
#include "module/view/letters.h"

namespace palpate {
namespace {

constexpr size_t kMostDrawn = 4;  // limit of the renderer
constexpr glm::dvec3 kPen{0.80, 0.83, 0.88}, kProxy{0.30, 0.78, 0.98}, kArrow{1.0, 0.62, 0.18};
// Colours of a fingertip in contact: different from flesh and bone, also for colour-blind people.
constexpr glm::dvec3 kTouch{0.25, 0.95, 1.0}, kPressed{0.10, 0.25, 1.0};
constexpr glm::dvec3 kBoxColour{0.42, 0.46, 0.54};
constexpr glm::dvec3 kLetters{0.80, 0.83, 0.88}, kLettersOnLight{0.16, 0.19, 0.25};
constexpr glm::dvec3 kLightTop{0.95, 0.96, 0.97}, kLightBottom{0.84, 0.86, 0.89};  // sRGB
constexpr glm::dvec3 kUsualDirection{0.42, 0.30, 1.0};  // towards the eye
constexpr double kHeightAngle = 0.55;                   // vertical angle of view, rad
constexpr double kArrow_m_per_n = 0.008;
// Of the line from the tip down to a wall, if radius_m is 10 cm: m.
constexpr double kLongestDrop = 0.2, kDropDash = 0.003, kDropLine = 0.0004;
constexpr double kTube = 0.0006;              // m, radius if radius_m is 10 cm
constexpr double kKeptTube = 1.6;             // factor on that for tubes that are kept
constexpr double kLongestPrediction_s = 0.1;  // an older tick is not extrapolated further

/// The least and greatest value of a frame on a coarse grid: sufficient to choose a look.
std::pair<double, double> range_of(const FrameData& frame) {
  constexpr int kAlong = 40;
  double low = 1e300, high = -1e300;
  for (int z = 0; z < kAlong; ++z)
    for (int y = 0; y < kAlong; ++y)
      for (int x = 0; x < kAlong; ++x) {
        const glm::dvec3 t = (glm::dvec3(x, y, z) + 0.5) / double(kAlong);
        const double value = frame.scalar(glm::mix(frame.low_m(), frame.high_m(), t));
        low = std::min(low, value);
        high = std::max(high, value);
      }
  return {low, high};
}

/// The same over all samples, if there are samples.
std::pair<double, double> exact_range_of(const FrameData& frame) {
  const ScalarSamples samples = frame.samples();
  if (samples.lowest > samples.highest) return range_of(frame);
  return {samples.lowest, samples.highest};
}

/// Whether a mode reads a surface between air and tissue in this CT: then lung and skin are shown.
bool feels_air(const Scene& scene, const SceneVolume& volume) {
  constexpr double kAir_hu = -900.0, kTissue_hu = -150.0;
  for (const SceneMode& mode : scene.modes) {
    if (mode.spec.volume != volume.spec.name || mode.spec.kind != "surface") continue;
    const std::vector<double>& in = mode.spec.strength.in();
    if (in.size() < 2) continue;
    const double level = 0.5 * (in.front() + in.back());
    if (level > kAir_hu && level < kTissue_hu) return true;
  }
  return false;
}

/// What is built in says what it looks like; of all else the data do.
Look fitting(const Scene& scene, const SceneVolume& volume) {
  const FrameData& frame = *volume.data->frames.front();
  if (frame.is_vector()) {
    const double high = range_of(frame).second;
    return windowed(*preset_look("flow"), 0.5 * high, std::max(high, 1e-9));
  }
  const std::string& source = volume.spec.source;
  if (source.starts_with("heart")) return *preset_look("heart");
  if (source.starts_with("shell")) return *preset_look("phantom");
  if (source == "molecule" || source == "charges") return *preset_look("molecule");
  const Look look = fitting_look(summary_of(frame));
  if (look.name.starts_with("CT") && feels_air(scene, volume)) return *preset_look("CT lung");
  return look;
}

/// The look named on the command line, else the scene's, else one that suits the data.
Look look_for(const std::string& name, const Scene& scene, const SceneVolume& volume) {
  if (name != "auto")
    if (auto preset = preset_look(name)) {
      if (name != "MR") return *preset;
      // MR has no unit: its window is that of the data.
      const ValueSummary values = summary_of(*volume.data->frames.front());
      const double width = std::max(values.foreground.back() - values.background, 1e-9);
      return windowed(*preset, values.background + 0.5 * width, width);
    }
  const AppearanceSpec& appearance = volume.spec.appearance;
  Look look;
  if (!appearance.points.empty()) {
    look.name = "of the scene";
    look.points = appearance.points;
    if (appearance.points_of_range) {
      const FrameData& frame = *volume.data->frames.front();
      const auto [low, high] = exact_range_of(frame);
      look = over_range(std::move(look), low, high, 1e3 * frame.detail_m());
    }
  } else if (auto preset = preset_look(appearance.preset); preset && !appearance.preset.empty()) {
    look = *preset;
  } else {
    look = fitting(scene, volume);
  }
  return appearance.width > 0.0 ? windowed(look, appearance.window_level, appearance.width) : look;
}

/// Black and white of slices: the lowest value and what is bright; of CT in HU air and dense bone,
/// or the nearest to them that is there.
glm::dvec2 greys_for(const FrameData& frame) {
  constexpr double kCt_hu = -300.0, kBlack_hu = -1000.0, kWhite_hu = 400.0;
  const ValueSummary values = summary_of(frame);
  const bool is_ct = values.lowest < kCt_hu;
  const double black = is_ct ? std::max(values.lowest, kBlack_hu) : values.lowest;
  const double bright = values.foreground.back();
  return {black, std::max(is_ct ? std::min(bright, kWhite_hu) : bright, black + 1e-9)};
}

/// The middle of what is inside of the visible segments, volume space, m; of the data where there
/// is nothing inside.
glm::dvec3 middle_of(const MovingVolume& volume) {
  constexpr int kAlong = 24;
  const FrameData& frame = *volume.frames.front();
  glm::dvec3 sum(0.0);
  int inside = 0;
  for (int z = 0; z < kAlong; ++z)
    for (int y = 0; y < kAlong; ++y)
      for (int x = 0; x < kAlong; ++x) {
        const glm::dvec3 share = (glm::dvec3(x, y, z) + 0.5) / double(kAlong);
        const glm::dvec3 at = glm::mix(frame.low_m(), frame.high_m(), share);
        for (const Segment& segment : volume.segments)
          if (segment.shown && segment.distance_mm.front()->scalar(at) > 0.0) sum += at, ++inside;
      }
  return inside > 0 ? sum / double(inside) : 0.5 * (frame.low_m() + frame.high_m());
}

/// Names what the colours of tubes along a field mean, in units that are read easily.
void name_tubes(TubeField field, glm::dvec2 lengths, glm::dvec3 (*colour)(double, double, double),
                ViewScene& scene) {
  if (!(lengths.y > 0.0)) return;
  const auto name = [&](const char* what, const char* unit_of, double factor) {
    const glm::dvec2 range = factor * lengths;
    scene.tube_colours.push_back(tube_colours(what, unit_of, range.x, range.y, colour));
  };
  // No format says of every file what its numbers are.
  switch (field) {
    case TubeField::kVectors:
      return name("vectors", "unit of the file", 1.0);
    case TubeField::kGradient:
      return name("slope", "per mm", 1e-3);
    case TubeField::kCurl:
      return name("curl", "per mm", 1e-3);
    case TubeField::kVelocity:
      return name("speed", "mm/s", 1e3);
  }
}

/// The points of a finger pad, each joined with the middle.
void add_points(const SceneSnapshot& snapshot, double radius_m, glm::dvec3 colour, Things& things) {
  for (int i = 0; i < snapshot.points.count; ++i) {
    const glm::dvec3 at_m = snapshot.points.proxies_m[size_t(i)];
    add_sphere(things, at_m, radius_m, colour);
    things.push_back({snapshot.proxy_m, at_m, 0.3 * radius_m, 0.3 * radius_m, colour});
  }
}

}  // namespace

Status check_look(const std::string& name) {
  if (name == "auto" || preset_look(name)) return Nothing{};
  std::string names = "auto";
  for (const std::string& preset : preset_names()) names += ", " + preset;
  return Error{ErrorKind::kBadInput,
               fmt::format("There is no look '{}': choose one of {}", name, names)};
}

void ScenePicture::choose(const ViewChoices& choices) {
  if (choices.look != choices_.look) looks_.clear();
  choices_ = choices;
}

bool ScenePicture::update(std::shared_ptr<const Scene> felt) {
  if (felt == felt_ && looks_.size() == volumes_.size()) return false;
  std::vector<std::shared_ptr<const MovingVolume>> volumes;
  shown_.clear();
  for (size_t v = 0; v < felt->volumes.size() && volumes.size() < kMostDrawn; ++v) {
    if (!felt->volumes[v].spec.appearance.shown) continue;
    shown_.push_back(v);
    volumes.push_back(felt->volumes[v].data);
  }
  if (looks_.size() != volumes.size()) {
    looks_.clear();
    greys_.clear();
    stream_.clear();
    for (const size_t v : shown_) {
      greys_.push_back(greys_for(*felt->volumes[v].data->frames.front()));
      looks_.push_back(look_for(choices_.look, *felt, felt->volumes[v]));
      stream_.emplace_back(felt->volumes[v].spec.appearance.tubes_per_axis);
    }
  }
  felt_ = std::move(felt);
  // A better motion of what is seen: the picture goes over to it, from where it was.
  better_since_ns_.resize(volumes.size(), kLongAgo);
  for (size_t v = 0; v < volumes.size(); ++v) {
    if (v < volumes_.size() && volumes[v] == volumes_[v]) continue;
    const bool is_better = v < volumes_.size() && volumes[v]->whole_before &&
                           volumes[v]->whole_before == volumes_[v]->whole;
    better_since_ns_[v] = is_better ? last_ns_ : kLongAgo;
  }
  const bool changed = volumes != volumes_;
  volumes_ = std::move(volumes);
  return changed;
}

bool ScenePicture::has_own_window() const {
  return !choices_.width && !choices_.level && choices_.level_moved == 0.0 &&
         choices_.width_factor == 1.0;
}

bool ScenePicture::has_patient(size_t v) const {
  return spec(v).source != "molecule" && spec(v).source != "charges";
}

Look ScenePicture::look_of(size_t v) const {
  const Look& look = looks_[v];
  const double width = choices_.width.value_or(width_of(look));
  const double level = choices_.level.value_or(level_of(look)) + choices_.level_moved * width;
  return has_own_window() ? look : windowed(look, level, width * choices_.width_factor);
}

Status ScenePicture::shows_something() const {
  for (size_t v = 0; v < volumes_.size(); ++v) {
    const FrameData& frame = *volumes_[v]->frames.front();
    if (spec(v).appearance.tubes.value_or(frame.is_vector())) return Nothing{};
    const auto& segments = volumes_[v]->segments;
    if (std::any_of(segments.begin(), segments.end(), [](const Segment& s) { return s.shown; }))
      return Nothing{};
    const auto [low, high] = exact_range_of(frame);
    const Look look = look_of(v);
    constexpr int kSteps = 1000;
    for (int k = 0; k <= kSteps; ++k)
      if (look_at(look, low + (high - low) * k / kSteps).extinction_per_mm > 0.0) return Nothing{};
  }
  if (volumes_.empty()) return Nothing{};
  const auto [low, high] = exact_range_of(*volumes_[0]->frames.front());
  const Look look = look_of(0);
  return Error{
      ErrorKind::kBadInput,
      fmt::format("Nothing of {} would be seen: its values are {:.6g} to {:.6g}, and the "
                  "look '{}' at level {:.6g} and width {:.6g} shows none of them: choose "
                  "another look, level or width",
                  volumes_[0]->name, low, high, look.name, level_of(look), width_of(look))};
}

glm::dvec2 ScenePicture::greys_of(size_t v) const {
  if (has_own_window()) return greys_[v];
  const Look look = look_of(v);
  return level_of(look) + 0.5 * width_of(look) * glm::dvec2(-1.0, 1.0);
}

std::vector<SliceWall> ScenePicture::walls() const {
  const MovingVolume& volume = *volumes_[0];
  std::vector<SliceWall> walls;
  for (size_t s = 0; s < volume.segments.size(); ++s)
    if (volume.segments[s].shown)
      walls.push_back({volume.segments[s].name, volume.segments[s].colour, 0.0, int(s)});
  for (const SceneMode& mode : felt_->modes) {
    if (!choices_.hand) break;
    const std::vector<double>& in = mode.spec.strength.in();
    if (mode.segment >= 0 || mode.spec.kind != "surface" || mode.spec.volume != spec(0).name ||
        mode.spec.scalar != ScalarProperty::kValue || in.empty())
      continue;
    const double iso_value = 0.5 * (in.front() + in.back());
    walls.push_back(
        {fmt::format("{}: {:.4g}", mode.spec.name, iso_value), glm::vec3(kProxy), iso_value, -1});
  }
  return walls;
}

std::optional<double> ScenePicture::height_m(const SceneSnapshot& snapshot, glm::dvec3 at_m,
                                             double most_m) const {
  if (volumes_.empty()) return {};
  constexpr int kSteps = 120, kHalvings = 8;
  const MovingVolume& volume = *volumes_[0];
  const VolumeSnapshot& of = snapshot.volumes[shown_[0]];
  const std::vector<SliceWall> all = walls();
  if (all.empty()) return {};
  MovedReader reader(volume, of.time_s);
  // Above 0 behind a wall; not a number where a segment is not known.
  const auto behind = [&](const SliceWall& wall, double down_m) {
    const glm::dvec3 y = of.world_from_volume.volume_from_world(at_m - glm::dvec3(0, down_m, 0));
    const glm::dvec3 x = reader.material_at(y);
    return wall.segment >= 0 ? reader.distance_mm(volume.segments[size_t(wall.segment)], x)
                             : reader.value(x) - wall.iso_value;
  };
  std::optional<double> nearest_m;
  for (const SliceWall& wall : all) {
    const double end_m = nearest_m.value_or(most_m), step_m = most_m / kSteps;
    double before = behind(wall, 0.0);
    for (double down_m = step_m; down_m < end_m; down_m += step_m) {
      const double now = behind(wall, down_m);
      if ((before > 0.0) == (now > 0.0) || !std::isfinite(before + now)) {
        before = now;
        continue;
      }
      double above_m = down_m - step_m, below_m = down_m;
      for (int n = 0; n < kHalvings; ++n) {
        const double middle_m = 0.5 * (above_m + below_m);
        ((behind(wall, middle_m) > 0.0) == (before > 0.0) ? above_m : below_m) = middle_m;
      }
      nearest_m = below_m;
      break;
    }
  }
  return nearest_m;
}

std::optional<OrthogonalSlices> ScenePicture::slices(const SceneSnapshot& snapshot,
                                                     int edge_px) const {
  if (volumes_.empty()) return {};
  const MovingVolume& volume = *volumes_[0];
  const VolumeSnapshot& of = snapshot.volumes[shown_[0]];
  const Transform& world = of.world_from_volume;
  const glm::dvec3 place_m =
      choices_.hand ? snapshot.proxy_m
                    : world.world_from_volume(middle_of(volume)) + choices_.slices_moved_m;
  const glm::dvec3 place = world.volume_from_world(place_m);
  double time_s = of.time_s;
  if (choices_.whole_frames) {
    const FrameTimes& times = volume.times;
    time_s = times.times_s[volume.whole ? volume.whole->reference()
                                        : size_t(pointer_at(times, of.time_s).frame)];
  }
  OrthogonalSlices slices = slices_through(volume, time_s, place, edge_px, walls());
  if (!has_patient(0))
    for (Slice& slice : slices.planes) slice.sides = {};
  const glm::dvec2 greys = greys_of(0);
  slices.black = greys.x;
  slices.white = greys.y;
  return slices;
}

std::vector<glm::dvec3> ScenePicture::corners(const SceneSnapshot& snapshot) const {
  std::vector<glm::dvec3> corners_m;
  // All volumes that are felt, also hidden ones, so that the hand stays in view.
  for (size_t v = 0; v < felt_->volumes.size(); ++v) {
    const DataBox edges = box_of(*felt_->volumes[v].data->frames.front());
    const Transform& place = snapshot.volumes[v].world_from_volume;
    for (int c = 0; c < 8; ++c) corners_m.push_back(place.world_from_volume(edges.corner(c)));
  }
  return corners_m;
}

void ScenePicture::bounds(const SceneSnapshot& snapshot, glm::dvec3& centre,
                          double& radius_m) const {
  const std::vector<glm::dvec3> corners_m = corners(snapshot);
  centre = middle_of(corners_m);
  radius_m = 0.0;
  for (const glm::dvec3 corner : corners_m)
    radius_m = std::max(radius_m, glm::distance(corner, centre));
}

void ScenePicture::add_things(const SceneSnapshot& snapshot, std::span<const Eye> eyes,
                              double radius_m, ViewScene& scene) {
  // scale of pen, tubes and other bodies: 1 for a scene of 10 cm radius
  const double size = radius_m / 0.1;
  if (choices_.hand) add_hand(snapshot, eyes[0], size, scene);
  for (size_t v = 0; v < volumes_.size(); ++v) add_tubes(v, kTube * size, scene);
  for (size_t v = 0; v < volumes_.size(); ++v) {
    const bool has_vectors = volumes_[v]->frames.front()->is_vector();
    if (!spec(v).appearance.tubes.value_or(has_vectors)) continue;
    const ViewVolume& of = scene.volumes[v];
    const glm::dvec2 lengths = stream_[v].add(scene.things, *volumes_[v], of.world_from_volume,
                                              of.pointer, kTube * size, choices_.whole_frames);
    name_tubes(has_vectors ? TubeField::kVectors : TubeField::kGradient, lengths, tube_colour,
               scene);
  }
  if (!choices_.box) return;
  for (size_t v = 0; v < volumes_.size(); ++v) {
    const DataBox edges = box_of(*volumes_[v]->frames.front());
    const Transform& place = scene.volumes[v].world_from_volume;
    add_box(scene.things, place, edges, 0.0004 * size, kBoxColour);
    if (has_patient(v))
      add_letters(scene.things, place, edges, eyes, 0.010 * size,
                  choices_.background == PictureBackground::kLight ? kLettersOnLight : kLetters);
  }
}

/// Adds the released tubes of volume v at the volume's pointer; the colours cover the range of all
/// tubes of the volume. Kept tubes are thicker.
void ScenePicture::add_tubes(size_t v, double radius_m, ViewScene& scene) const {
  if (!tubes_) return;
  const ViewVolume& of = scene.volumes[v];
  double least = 1e300, most = 0.0;
  for (const ReleasedTube& one : *tubes_)
    for (const double length : one.tube->lengths())
      if (one.volume == shown_[v] && length > 0.0)
        least = std::min(least, length), most = std::max(most, length);
  for (const ReleasedTube& one : *tubes_) {
    if (one.volume != shown_[v]) continue;
    const MovingVolume& data = *one.tube->data();
    // If frames are drawn as they are, so are tubes.
    FramePointer at = of.pointer;
    if (choices_.whole_frames) at = {data.whole ? int(data.whole->reference()) : at.frame, 0.0};
    std::vector<glm::dvec3> places = one.tube->places(at);
    for (glm::dvec3& x : places) x = of.world_from_volume.world_from_volume(x);
    const double radius = one.kept ? kKeptTube * radius_m : radius_m;
    for (size_t k = 1; k < places.size(); ++k)
      scene.things.push_back({places[k - 1], places[k], radius, radius,
                              released_tube_colour(one.tube->lengths()[k], least, most)});
  }
  for (const ReleasedTube& one : *tubes_)
    if (one.volume == shown_[v])
      return name_tubes(one.tube->field(), {least, most}, released_tube_colour, scene);
}

void ScenePicture::add_hand(const SceneSnapshot& snapshot, const Eye& eye, double size,
                            ViewScene& scene) {
  if (snapshot.has_second) {
    SceneSnapshot second = snapshot;
    second.has_second = false;
    second.probe_m = snapshot.second.probe_m;
    second.proxy_m = snapshot.second.proxy_m;
    second.shaft = snapshot.second.shaft;
    second.force_n = snapshot.second.force_n;
    second.in_contact = snapshot.second.in_contact;
    second.points = snapshot.second.points;
    add_hand(second, eye, size, scene);
  }
  if (!snapshot.in_contact) add_drop_line(snapshot, size, scene);
  if (choices_.fingertip) {
    const double share =
        std::clamp(glm::length(snapshot.force_n) / std::max(choices_.full_force_n, 1e-9), 0.0, 1.0);
    // In contact at the proxy, on the surface: the finger itself is hidden inside.
    const bool touches = snapshot.in_contact;
    const double ball_m = felt_->tool_radius_m > 0.0 ? felt_->tool_radius_m : 0.007 * size;
    const glm::dvec3 colour = touches ? glm::mix(kTouch, kPressed, share) : kPen;
    if (snapshot.points.count > 0)
      add_points(snapshot, 0.004 * size, colour, scene.things);
    else
      add_sphere(scene.things, touches ? snapshot.proxy_m : snapshot.probe_m, ball_m, colour);
    return;
  }
  // The pen turns with the hand. Of a device that does not sense it, its shaft extends to the side
  // and towards the eye, so that its tip is visible.
  const glm::dvec3 away = snapshot.shaft != glm::dvec3(0.0)
                              ? snapshot.shaft
                              : glm::normalize(eye.orientation * glm::dvec3(0.45, 0.55, 0.70));
  add_pen(scene.things, snapshot.probe_m, away, 0.0022 * size, 0.07 * size, kPen);
  // A ball as tool has its own size, also where it touches nothing.
  const double tool_m = felt_->tool_radius_m;
  if (snapshot.points.count > 0)
    add_points(snapshot, 0.0022 * size, snapshot.in_contact ? kProxy : kPen, scene.things);
  else if (snapshot.in_contact || tool_m > 0.0)
    add_sphere(scene.things, snapshot.proxy_m, tool_m > 0.0 ? tool_m : 0.0026 * size,
               snapshot.in_contact ? kProxy : kPen);
  add_arrow(scene.things, snapshot.proxy_m, snapshot.force_n, kArrow_m_per_n * size, 0.0012 * size,
            kArrow);
}

/// From the tip straight down to the first wall, so that its depth is seen: dashes, less visible
/// the longer it is, and a dot where it ends.
void ScenePicture::add_drop_line(const SceneSnapshot& snapshot, double size,
                                 ViewScene& scene) const {
  const double most_m = kLongestDrop * size;
  const auto height = height_m(snapshot, snapshot.probe_m, most_m);
  if (!height) return;
  const glm::dvec3 colour =
      glm::mix(choices_.background == PictureBackground::kLight ? kLettersOnLight : kProxy,
               0.5 * (scene.background_top + scene.background_bottom), 0.85 * *height / most_m);
  const glm::dvec3 down(0.0, -1.0, 0.0);
  const double dash_m = kDropDash * size, radius_m = kDropLine * size;
  for (double from_m = 0.0; from_m < *height; from_m += 2.0 * dash_m)
    scene.things.push_back({snapshot.probe_m + from_m * down,
                            snapshot.probe_m + std::min(from_m + dash_m, *height) * down, radius_m,
                            radius_m, colour});
  add_sphere(scene.things, snapshot.probe_m + *height * down, 3.0 * radius_m, colour);
}

ViewScene ScenePicture::at(const SceneSnapshot& snapshot, int64_t display_ns,
                           std::span<const Eye> eyes) {
  ViewScene scene;
  last_ns_ = snapshot.now_ns;
  const double ahead_s =
      std::clamp(double(display_ns - snapshot.now_ns) * 1e-9, 0.0, kLongestPrediction_s);
  for (size_t v = 0; v < volumes_.size(); ++v) {
    const VolumeSnapshot& of = snapshot.volumes[shown_[v]];
    ViewVolume volume;
    volume.data = volumes_[v];
    volume.world_from_volume = of.world_from_volume;
    volume.pointer = pointer_at(volumes_[v]->times, of.time_s + of.rate * ahead_s);
    volume.look = look_of(v);
    volume.blend_values = felt_->volumes[shown_[v]].blends;
    volume.whole_frames = choices_.whole_frames;
    if (better_since_ns_[v] != kLongAgo)
      volume.whole_share =
          share_of_better(1e-9 * double(snapshot.now_ns - better_since_ns_[v]) / kMotionBlend_s);
    volume.segment_opacity = spec(v).appearance.segments ? spec(v).appearance.segment_opacity : 0.0;
    scene.volumes.push_back(volume);
  }
  if (choices_.background == PictureBackground::kLight) {
    scene.background_top = kLightTop;
    scene.background_bottom = kLightBottom;
  } else if (choices_.background == PictureBackground::kNone) {
    scene.background_top = scene.background_bottom = glm::dvec3(0.0);
  }
  scene.shadows = choices_.shadows;
  glm::dvec3 centre;
  double radius_m = 0.0;
  bounds(snapshot, centre, radius_m);
  add_things(snapshot, eyes, radius_m, scene);
  if (choices_.cut_open) {
    const glm::dvec3 touched = choices_.hand ? snapshot.proxy_m : centre;
    scene.clips.push_back(cut_before(eyes[0], touched, centre, radius_m));
  }
  return scene;
}

ClipPlane cut_before(const Eye& eye, glm::dvec3 touched_m, glm::dvec3 centre_m, double radius_m) {
  // Rotation away from the view, so that the cut's edge shows its depth.
  constexpr double kAside = 0.6;   // radians
  constexpr double kFront = 0.45;  // share of the radius: a hand in front of everything still cuts
  const glm::dvec3 away = eye.orientation * glm::dvec3(-std::sin(kAside), 0.0, -std::cos(kAside));
  const double towards_eye = glm::dot(centre_m - touched_m, away);
  const double before_m = std::clamp(towards_eye, 0.0, kFront * radius_m);
  return {away, glm::dot(away, centre_m) - before_m};
}

double usual_azimuth_deg() {
  return glm::degrees(std::atan2(kUsualDirection.x, kUsualDirection.z));
}

glm::dvec3 middle_of(std::span<const glm::dvec3> corners_m) {
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const glm::dvec3 corner : corners_m) {
    low = glm::min(low, corner);
    high = glm::max(high, corner);
  }
  return corners_m.empty() ? glm::dvec3(0.0) : 0.5 * (low + high);
}

Eye eye_before(std::span<const glm::dvec3> corners_m, PictureSize size, const SeenFrom& from) {
  constexpr double kFilled = 0.93;  // share of the picture: letters stand around the box
  const glm::dvec3 centre = middle_of(corners_m);
  glm::dvec3 direction = glm::normalize(kUsualDirection);
  if (from.azimuth_deg || from.elevation_deg) {
    const double azimuth = glm::radians(from.azimuth_deg.value_or(usual_azimuth_deg()));
    const double elevation =
        from.elevation_deg ? glm::radians(*from.elevation_deg) : std::asin(direction.y);
    direction = {std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                 std::cos(elevation) * std::cos(azimuth)};
  }
  const Eye unit = eye_at(centre + direction, centre, kHeightAngle, size);
  // Far enough for every corner to be within both angles of view.
  double distance = 1e-6;
  for (const glm::dvec3 corner_m : corners_m) {
    const glm::dvec3 corner = glm::conjugate(unit.orientation) * (corner_m - centre);
    const double needed = std::max(std::abs(corner.x) / (kFilled * unit.tan_right),
                                   std::abs(corner.y) / (kFilled * unit.tan_up));
    distance = std::max(distance, needed + corner.z);
  }
  // Closer, the picture would be distorted: the angles become smaller.
  Eye eye = eye_at(centre + distance * direction, centre, kHeightAngle, size);
  for (double* side : {&eye.tan_left, &eye.tan_right, &eye.tan_down, &eye.tan_up})
    *side /= from.zoom;
  return eye;
}

std::array<Eye, 2> eyes_before(std::span<const glm::dvec3> corners_m, PictureSize size,
                               const SeenFrom& from) {
  const Eye middle = eye_before(corners_m, size, from);
  return eyes_of_head(middle, glm::distance(middle.position_m, middle_of(corners_m)));
}

std::array<Eye, 2> eyes_of_head(const Eye& middle, double distance) {
  std::array<Eye, 2> eyes;
  // The distance of the eyes is in proportion to the distance of the scene, as for a person who
  // sees something at half a metre.
  split_eyes(middle, 0.063 * distance / 0.5, eyes[0], eyes[1]);
  // With parallel eyes that far apart each would lose one side of the picture: their angles are
  // shifted so that both frame the same at the depth of the centre.
  const double shift = 0.5 * 0.063 / 0.5;
  eyes[0].tan_left += shift, eyes[0].tan_right += shift;
  eyes[1].tan_left -= shift, eyes[1].tan_right -= shift;
  return eyes;
}

}  // namespace palpate
