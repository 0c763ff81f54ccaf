#include "tests/lab/bench/hearts_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <stdexcept>

#include "compute/motion/estimate_sequence.h"
#include "compute/volume/heart_phantom.h"
#include "compute/volume/parallel.h"
#include "compute/volume/signed_distance.h"
#include "compute/vulkan/context.h"
#include "integration/devices/simulated.h"
#include "integration/files/raster/write_field.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "integration/loading/load_scene.h"
#include "integration/running/touch.h"
#include "module/scene/built_in.h"
#include "module/scene/derived_wall.h"
#include "module/scene/make_volume.h"
#include "module/scene/segment_modes.h"
#include "module/scene/wall_value.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::bench {
namespace {

namespace fs = std::filesystem;

// Larger distances are cut.
constexpr double kClip_mm = 8.0;
constexpr double kFull_n = 4.0;  // strength of every wall
// In front of a place there must be nothing over this distance.
constexpr double kClear_mm = 8.0;

template <class T>
T value(Result<T> result) {
  if (!result) throw studies::Mismatch(result.error().message);
  return std::move(*result);
}

using IsInside = std::function<bool(float)>;

Mask mask_of(const Volume& of, const IsInside& is_inside) {
  Mask mask{of.grid, std::vector<uint8_t>(of.values.size())};
  std::transform(of.values.begin(), of.values.end(), mask.values.begin(), is_inside);
  return mask;
}

/// The distance in the form in which a segment is felt and drawn.
std::shared_ptr<const FrameData> smooth_distance(const Volume& of, const IsInside& is_inside) {
  return sampled_scalar(signed_distance(mask_of(of, is_inside)));
}

/// Within each slice: signed distance to the border of the pixels that are inside, taken as boxes,
/// mm, above 0 inside, cut at kClip_mm.
Volume distance_in_slices(const Volume& of, const IsInside& is_inside) {
  const Grid& grid = of.grid;
  const Mask inside = mask_of(of, is_inside);
  const glm::ivec3 reach = glm::ivec3(glm::ceil(glm::dvec3(kClip_mm) / grid.spacing_mm)) + 1;
  Volume distance{grid, std::vector<float>(grid.count())};
  parallel_ranges(grid.size.z, 1e6, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i) {
          const bool here = inside.values[grid.offset(i, j, k)];
          double nearest = kClip_mm * kClip_mm;
          for (int y = std::max(0, j - reach.y); y < std::min(grid.size.y, j + reach.y + 1); ++y)
            for (int x = std::max(0, i - reach.x); x < std::min(grid.size.x, i + reach.x + 1);
                 ++x) {
              if (bool(inside.values[grid.offset(x, y, k)]) == here) continue;
              const glm::dvec2 gap =
                  glm::max(glm::dvec2(std::abs(x - i), std::abs(y - j)) - 0.5, 0.0) *
                  glm::dvec2(grid.spacing_mm);
              nearest = std::min(nearest, glm::dot(gap, gap));
            }
          distance.values[grid.offset(i, j, k)] = float((here ? 1.0 : -1.0) * std::sqrt(nearest));
        }
  });
  return distance;
}

/// Points where the distance in frame 0 is 0 and has the slope of a wall, spread evenly: each is
/// the farthest from those before it.
struct Choice {
  /// Volume space: the direction of the hand; 0: any.
  glm::dvec3 towards{0.0};
  std::function<bool(glm::dvec3)> ok;  ///< of a point, volume space; empty: all
  int slice_low = 0, slice_high = 1 << 20;
};

std::vector<Place> places_on(const FrameData& distance, const Grid& grid, int count,
                             const Choice& choice) {
  std::vector<Place> all;
  const glm::dvec3 axis = glm::normalize(volume_from_lps(grid.direction[2]));
  for (int k = std::max(1, choice.slice_low); k <= std::min(grid.size.z - 2, choice.slice_high);
       ++k)
    for (int j = 1; j + 1 < grid.size.y; ++j)
      for (int i = 1; i + 1 < grid.size.x; ++i)
        for (int along = 0; along < 2; ++along) {
          const glm::dvec3 step(along == 0, along == 1, 0);
          const glm::dvec3 a = volume_from_lps(grid.lps_from_index(glm::dvec3(i, j, k)));
          const glm::dvec3 b = volume_from_lps(grid.lps_from_index(glm::dvec3(i, j, k) + step));
          const double at_a = distance.scalar(a), at_b = distance.scalar(b);
          if ((at_a > 0.0) == (at_b > 0.0)) continue;
          Place place;
          place.at_m = a + (b - a) * (at_a / (at_a - at_b));
          const glm::dvec3 uphill = distance.scalar_gradient(place.at_m);
          if (glm::length(uphill) < 500.0) continue;
          place.out = -glm::normalize(uphill);
          if (choice.towards != glm::dvec3(0.0) && glm::dot(place.out, choice.towards) < 0.2)
            continue;
          if (std::abs(glm::dot(place.out, axis)) > 0.8) continue;
          if (distance.scalar(place.at_m + 1e-3 * kClear_mm * place.out) > 0.0) continue;
          if (choice.ok && !choice.ok(place.at_m)) continue;
          all.push_back(place);
        }
  if (all.empty()) return all;
  glm::dvec3 middle(0.0);
  for (const Place& place : all) middle += place.at_m / double(all.size());
  const glm::dvec3 ahead = glm::normalize(choice.towards - axis * glm::dot(choice.towards, axis) +
                                          1e-9 * choice.towards);
  const glm::dvec3 right = glm::cross(ahead, axis);
  std::vector<Place> chosen;
  std::vector<double> far(all.size(), 1e9);
  size_t next = 0;
  while (int(chosen.size()) < std::min(count, int(all.size()))) {
    Place place = all[next];
    const glm::dvec3 arm = place.at_m - middle;
    place.x = std::atan2(glm::dot(arm, right), glm::dot(arm, ahead)) * 180.0 / std::numbers::pi;
    place.y = 1e3 * glm::dot(arm, axis);
    chosen.push_back(place);
    for (size_t n = 0; n < all.size(); ++n)
      far[n] = std::min(far[n], glm::distance(all[n].at_m, place.at_m));
    next = size_t(std::max_element(far.begin(), far.end()) - far.begin());
  }
  return chosen;
}

struct Motions {
  SequenceMotion whole;
  std::vector<MotionData> pairs;  ///< one: consecutive fields with their confidences
};

/// Estimated, or read from the folder where an earlier run stored them.
Motions motions_of(const HeartsOptions& options, const std::string& name,
                   files::SequenceReader& reader, const FrameTimes& times) {
  const size_t count = reader.frame_count();
  const fs::path folder =
      options.keep.empty() ? fs::path() : options.keep / (name + "_" + options.preset);
  const auto file = [&](const char* what, size_t k) {
    return folder / fmt::format("{}_{:02}.mha", what, k);
  };
  Motions motions;
  motions.pairs.resize(1);
  motions.whole.basis.times_s = times.times_s;
  motions.whole.basis.cycle_s = times.cycle_s;
  if (std::ifstream words(folder / "motion.txt"); !folder.empty() && words) {
    words >> motions.whole.reference >> motions.whole.basis.harmonics;
    for (size_t n = 0; n < motions.whole.basis.terms(); ++n)
      motions.whole.terms.push_back(value(files::read_field(file("term", n))));
    for (size_t k = 0; k < count; ++k) {
      motions.pairs[0].fields.push_back(value(files::read_field(file("motion", k))));
      Volume confidence = value(files::read_volume(file("confidence", k)));
      motions.pairs[0].confidences.push_back({confidence.grid, std::move(confidence.values)});
    }
    return motions;
  }
  const auto context = value(vulkan::Context::open({}));
  std::vector<Volume> frames;
  for (size_t k = 0; k < count; ++k) frames.push_back(value(reader.frame(k)));
  SequenceMotionOptions how;
  how.estimator.motion = *motion_preset(options.preset);
  how.estimator.cyclic = true;
  motions.pairs[0].fields.resize(count);
  motions.pairs[0].confidences.resize(count);
  motions.whole = value(estimate_sequence_motion(
      context, reader.grid(), times.times_s, [&](size_t k) -> Result<Volume> { return frames[k]; },
      how,
      [&](PairMotion pair) {
        motions.pairs[0].fields[pair.fixed_frame] = std::move(pair.field);
        motions.pairs[0].confidences[pair.fixed_frame] = std::move(pair.confidence);
      }));
  if (folder.empty()) return motions;
  fs::create_directories(folder);
  for (size_t n = 0; n < motions.whole.terms.size(); ++n)
    value(files::write_field(motions.whole.terms[n], file("term", n)));
  for (size_t k = 0; k < count; ++k) {
    value(files::write_field(motions.pairs[0].fields[k], file("motion", k)));
    value(files::write_confidence(motions.pairs[0].confidences[k], file("confidence", k)));
  }
  std::ofstream(folder / "motion.txt")
      << motions.whole.reference << ' ' << motions.whole.basis.harmonics << '\n';
  return motions;
}

/// A sequence as it is read, felt by its values: with each frame's own, and with the reference
/// frame's.
struct ReadSequence {
  files::SequenceReader reader;
  MovingVolume own;
  SequenceMotion whole;
  WallValue otsu;
};

ReadSequence read(const HeartsOptions& options, const std::string& name,
                  const std::vector<fs::path>& inputs) {
  auto reader = value(files::SequenceReader::open(inputs));
  VolumeSpec spec;
  spec.name = name;
  VolumeData data;
  data.frames.times_known = reader.times_known();
  data.frames.times_s = reader.times_s();
  for (size_t k = 0; k < reader.frame_count(); ++k)
    data.frames.frames.push_back(value(reader.frame(k)));
  WallValue otsu = value_between_groups(data.frames.frames.front());
  if (options.level != 0.0) otsu.iso_value = options.level;
  // For files without times: the true period of this heart.
  if (!reader.times_known()) spec.frames_per_second = double(reader.frame_count()) / 0.63;
  MovingVolume own = value(build(spec, std::move(data)));
  Motions motions = motions_of(options, name, reader, own.times);
  spec.motions = {MotionSpec{}};
  Motion motion{"data", {}};
  for (size_t k = 0; k < motions.pairs[0].fields.size(); ++k)
    motion.steps.push_back(
        MotionMap::of(motions.pairs[0].fields[k], &motions.pairs[0].confidences[k]));
  own.motions = {std::move(motion)};
  return {std::move(reader), std::move(own), std::move(motions.whole), otsu};
}

void add_by_values(Subject& subject, const ReadSequence& from) {
  Felt own{"own values, Otsu", std::make_shared<const MovingVolume>(from.own), false,
           value(TransferFunction::window(from.otsu.iso_value, from.otsu.width, kFull_n))};
  Felt carried_values = own;
  carried_values.name = "carried values, Otsu";
  const auto carried_volume =
      std::make_shared<const MovingVolume>(value(carried(from.own, from.whole)));
  carried_values.volume = carried_volume;
  subject.whole = carried_volume->whole;
  subject.felt.push_back(std::move(own));
  subject.felt.push_back(std::move(carried_values));
}

/// Half the thickness that a usual wall needs where this is shown on a usual device.
double usual_half_mm(const FrameData& frame) {
  return half_thickness_mm(kFirmPress_n, SceneSpec().stiffness_n_per_m,
                           SegmentSpec().stiffness_n_per_m, scale_to_reach(frame, kUsualReach_m));
}

/// Ways to feel without a segmentation, each with its own surface: the values, and the walls
/// derived from them.
void add_derived(Subject& subject, const Volume& reference, const HeartsOptions& options) {
  const auto carried_volume = subject.felt.back().volume;
  const auto add = [&](const std::string& name, const Volume& distance_mm, bool values) {
    auto volume = std::make_shared<MovingVolume>(*carried_volume);
    const auto distance = sampled_scalar(distance_mm);
    volume->segments = {{"wall", glm::vec3(1.0F), {distance}}};
    Wall wall{"its own surface", name, "wall", {}, distance, {}, {}};
    wall.places = places_on(*distance, reference.grid, 2 * options.places, {});
    subject.walls.push_back(std::move(wall));
    if (!values)
      subject.felt.push_back(
          {name, volume, true, value(TransferFunction::linear({0.0, 1.0}, {0.0, kFull_n}))});
  };
  const double level = wall_of(reference).at.iso_value;
  const auto above = [level](float v) { return v > level; };
  add(subject.felt.back().name, signed_distance(mask_of(reference, above)), true);
  const double half_mm = usual_half_mm(*carried_volume->frames.front());
  for (const auto& [name, derive] :
       {std::pair{"region carried", &region_wall}, {"ridges carried", &ridge_wall}})
    if (const auto wall = derive(reference, half_mm, {}, {})) add(name, wall->distance_mm, false);
}

/// heart_cine: the files of its frames and labels, and the labels.
struct HeartCine {
  explicit HeartCine(const HeartsOptions& options) : folder(options.shared / "heart_cine") {
    for (int k = 0; k < 20; ++k) {
      frames.push_back(folder / fmt::format("frame_{:02}.mha", k));
      label_files.push_back(folder / fmt::format("lv_{:02}.mha", k));
      labels.push_back(value(files::read_volume(label_files.back())));
    }
  }
  fs::path folder;
  std::vector<fs::path> frames, label_files;
  std::vector<Volume> labels;
};

/// What is seen of a wall from in front of the patient, lit from there: parallel rays, x to the
/// right, y up, mm.
report::Backdrop picture_of(const FrameData& distance) {
  constexpr double kPixel_m = 0.75e-3, kStep_m = 0.5e-3;
  const glm::dvec3 low = distance.low_m(), high = distance.high_m();
  const glm::ivec2 size = glm::ceil(glm::dvec2(high - low) / kPixel_m);
  report::Backdrop picture;
  picture.left = 1e3 * low.x, picture.right = 1e3 * (low.x + size.x * kPixel_m);
  picture.bottom = 1e3 * low.y, picture.top = 1e3 * (low.y + size.y * kPixel_m);
  picture.columns = size_t(size.x);
  for (int row = 0; row < size.y; ++row)
    for (int column = 0; column < size.x; ++column) {
      glm::dvec3 x(low.x + (column + 0.5) * kPixel_m, low.y + (row + 0.5) * kPixel_m, high.z);
      while (x.z > low.z && distance.scalar(x) <= 0.0) x.z -= kStep_m;
      const glm::dvec3 slope = distance.scalar_gradient(x);
      const bool seen = x.z > low.z && glm::length(slope) > 0.0;
      picture.values.push_back(seen ? 0.25 + 0.65 * std::max(0.0, -glm::normalize(slope).z)
                                    : std::nan(""));
    }
  return picture;
}

}  // namespace

Subject beating_heart(const HeartsOptions& options) {
  const auto [folder, inputs, label_files, labels] = HeartCine(options);
  ReadSequence sequence = read(options, "heart_cine", inputs);
  Subject subject;
  subject.name = "heart_cine";
  add_by_values(subject, sequence);
  struct Named {
    const char *name, *segment;
    IsInside is_inside;
  };
  auto with_segments = std::make_shared<MovingVolume>(*subject.felt.back().volume);
  for (const Named& of : {Named{"epicardium", "heart", [](float v) { return v > 0.5F; }},
                          Named{"endocardium", "pool", [](float v) { return v > 1.5F; }}}) {
    Wall wall;
    wall.name = of.name;
    wall.segment = of.segment;
    const Volume& reference = labels[sequence.whole.reference];
    wall.distance_mm = smooth_distance(reference, of.is_inside);
    for (const Volume& frame : labels)
      wall.contours_mm.push_back(sampled_scalar(distance_in_slices(frame, of.is_inside)));
    const auto first = smooth_distance(labels[0], of.is_inside);
    with_segments->segments.push_back({of.segment, glm::vec3(1.0F), {wall.distance_mm}});
    Choice choice;
    // The hand is in front of the patient's chest.
    choice.towards = {0.0, 0.0, 1.0};
    choice.slice_low = 2;
    choice.slice_high = 12;
    wall.places = places_on(*first, labels[0].grid, options.places, choice);
    Choice everywhere = choice;
    everywhere.towards = glm::dvec3(0.0);
    for (const Place& place : places_on(*wall.distance_mm, reference.grid, 400, everywhere))
      wall.surface_m.push_back(place.at_m);
    subject.walls.push_back(std::move(wall));
  }
  add_derived(subject, value(sequence.reader.frame(sequence.whole.reference)), options);
  subject.felt.push_back({"segmentation carried", with_segments, true,
                          value(TransferFunction::window(0.0, 1.0, kFull_n))});
  return subject;
}

Subject heart_as_felt(const HeartsOptions& options) {
  const HeartCine cine(options);
  const ReadSequence sequence = read(options, "heart_cine", cine.frames);
  const size_t reference = sequence.whole.reference;
  Subject subject;
  subject.name = "heart_cine as felt";
  std::vector<std::shared_ptr<const FrameData>> contours;
  for (const Volume& frame : cine.labels)
    contours.push_back(sampled_scalar(distance_in_slices(frame, [](float v) { return v > 0.5F; })));

  const auto add = [&](const char* name, Result<LoadedScene> loaded, bool is_epicardium) {
    LoadedScene scene = value(std::move(loaded));
    const DeviceInfo device = devices::info_of({});
    if (scene.from_sequence) fit_to_reach(scene, device);
    const auto own_place = running::place_to_touch(scene, device);
    if (!own_place) throw studies::Mismatch(fmt::format("{}: there is no place to press", name));
    const bool stands = !scene.missing.empty() && scene.missing.front().own;
    const MovingVolume& own = stands ? *scene.missing.front().own : *scene.data.front();
    Felt felt{name,
              std::make_shared<const MovingVolume>(value(carried(own, sequence.whole))),
              true,
              {},
              std::move(scene.spec)};
    if (felt.volume->segments.empty())
      throw studies::Mismatch(fmt::format("{}: nothing but values is felt", name));
    felt.path.emplace();
    subject.whole = felt.volume->whole;

    // The wall that is felt from outside is the first. The places on it are those of the reference
    // frame, and the program's own place in the frame that it begins with. On the picture all are
    // in the reference frame, the hand goes to where they are in frame 0.
    const Segment& outer = felt.volume->segments.front();
    Wall wall{"felt from outside", name, outer.name, {}, outer.distance_mm.front(), {}, {}, {}};
    Choice choice;
    choice.towards = {0.0, 0.0, 1.0};
    wall.places = places_on(*wall.distance_mm, cine.labels[reference].grid, options.places, choice);
    const SequenceMap& whole = *felt.volume->whole;
    const auto aside = [&](glm::dvec3 x) {
      return whole.displacement(x, whole.basis().at(0, 0.0));
    };
    const Transform& shown = felt.spec->volumes.front().transform;
    const Transform& device_in_world = felt.spec->world_from_device;
    Place at{shown.volume_from_world(device_in_world.world_from_volume(own_place->surface_m)),
             glm::normalize(glm::conjugate(shown.rotation) *
                            (device_in_world.rotation * own_place->outward))};
    if (!stands || own.segments_frame != reference) at.at_m -= aside(at.at_m);
    wall.places.insert(wall.places.begin(), at);
    for (Place& place : wall.places) {
      place.x = 1e3 * place.at_m.x, place.y = 1e3 * place.at_m.y;
      place.at_m += aside(place.at_m);
    }
    if (is_epicardium) wall.contours_mm = contours;
    wall.picture = picture_of(*wall.distance_mm);
    subject.walls.push_back(std::move(wall));
    subject.felt.push_back(std::move(felt));
  };
  loading::SequenceChoices choices;
  add("default", loading::load_scene(cine.frames, choices), false);
  choices.segments = cine.label_files;
  add("segments", loading::load_scene(cine.frames, choices), true);
  choices = {};
  choices.folder = cine.folder;
  add("heart.json", loading::load_scene({PALPATE_HEART_SCENE}, choices), true);
  return subject;
}

Subject breathing_lung(const HeartsOptions& options) {
  ReadSequence sequence = read(options, "breathing", {options.shared / "lung/breathing.seq.nrrd"});
  Subject subject;
  subject.name = "breathing";
  add_by_values(subject, sequence);
  const double level = sequence.otsu.iso_value;
  const IsInside above = [level](float v) { return v > level; };
  Wall wall;
  wall.name = "Otsu's surface";
  const Volume reference = value(sequence.reader.frame(sequence.whole.reference));
  wall.distance_mm = sampled_scalar(exact_signed_distance(mask_of(reference, above)));
  Choice choice;
  choice.towards = {0.0, 0.0, 1.0};
  const Volume frame = value(sequence.reader.frame(0));
  wall.places = places_on(*smooth_distance(frame, above), frame.grid, options.places, choice);
  subject.walls.push_back(std::move(wall));
  return subject;
}

Subject heart_phantom_subject(const HeartsOptions& options) {
  const SceneSpec scene = heart_scene();
  VolumeSpec spec = scene.volumes.front();
  Felt own{"own values, the scene's level",
           std::make_shared<const MovingVolume>(value(build(spec))), false,
           scene.modes.front().strength};
  SequenceMotion truth;
  truth.basis.times_s = own.volume->times.times_s;
  truth.basis.cycle_s = own.volume->times.cycle_s;
  const int frames = int(own.volume->frames.size());
  for (int k = 0; k < frames; ++k) truth.terms.push_back(heart_truth(heart_grid(64), 0, k, frames));
  Felt carried_values = own;
  carried_values.name = "carried values, the scene's level";
  carried_values.volume = std::make_shared<const MovingVolume>(value(carried(*own.volume, truth)));
  Subject subject;
  subject.name = "heart phantom";
  subject.whole = carried_values.volume->whole;
  const Grid grid = heart_grid(128);
  Volume frame{grid, std::vector<float>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        frame.values[grid.offset(i, j, k)] =
            float(own.volume->frames[0]->scalar(volume_from_lps(grid.lps_from_index({i, j, k}))));
  Wall wall;
  wall.name = "wall";
  const IsInside solid = [](float v) { return v > 365.0F; };
  wall.distance_mm = sampled_scalar(exact_signed_distance(mask_of(frame, solid)));
  Choice choice;
  choice.towards = {0.0, 0.0, 1.0};
  wall.places = places_on(*smooth_distance(frame, solid), grid, options.places, choice);
  subject.walls.push_back(std::move(wall));
  subject.felt = {std::move(own), std::move(carried_values)};
  return subject;
}

std::string derived_in(const Volume& frame) {
  std::string text;
  for (const auto& [name, made] : {std::pair{"region", &region_wall}, {"ridges", &ridge_wall}}) {
    const auto begin = std::chrono::steady_clock::now();
    const auto wall = made(frame, usual_half_mm(*sampled_scalar(frame)), {}, {});
    const double took_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (wall)
      text += fmt::format(
          "  {}: smoothed by {:.3g}, closed by {:.3g}, opened by {:.3g} mm, ends at {:.1f} % "
          "({:.1f} "
          "% where 2 N are needed); {:.2f} s\n",
          name, wall->smooth_mm, wall->closed_mm, wall->opened_mm,
          100.0 * wall_quality(wall->distance_mm, {0.0, 1.0}).ends, 100.0 * wall->ends, took_s);
    else
      text += fmt::format("  {}: none\n", name);
  }
  return text;
}

std::string walls_in(const std::vector<fs::path>& inputs) {
  auto reader = value(files::SequenceReader::open(inputs));
  const Volume frame = value(reader.frame(0));
  const auto begin = std::chrono::steady_clock::now();
  const WallQuality found = wall_of(frame);
  const double took_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const WallQuality otsu = wall_quality(frame, value_between_groups(frame));
  return fmt::format(
             "{}: Otsu {:.4g}, {:.3g} per mm, ends at {:.0f} %; found {:.4g}, {:.3g} per mm, ends "
             "at "
             "{:.0f} "
             "%{}; {:.2f} s\n",
             inputs.front().string(), otsu.at.iso_value, otsu.slope_per_mm, 100.0 * otsu.ends,
             found.at.iso_value, found.slope_per_mm, 100.0 * found.ends,
             found.ends > kClosedWall ? ", no closed wall" : "", took_s) +
         derived_in(frame);
}

}  // namespace palpate::bench
