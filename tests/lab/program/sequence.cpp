// The accuracy of one motion for a whole sequence, compared with chained consecutive fields. On the
// breathing CT, with the known motion of 400 points over all ordered pairs of frames; on the
// beating heart, by the Dice overlap of the left ventricle's labels, carried from every frame to
// every other. Both: drift over the cycle, folds at the frames and between them.
#include <fmt/format.h>

#include <optional>
#include <random>

#include "compute/motion/estimate_sequence.h"
#include "compute/motion/quality.h"
#include "compute/motion/quality_inverse.h"
#include "compute/vulkan/context.h"
#include "integration/app/exit_code.h"
#include "integration/app/gpu.h"
#include "integration/app/option_checks.h"
#include "integration/files/landmarks.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "module/haptics/proxy/back_track.h"
#include "tests/lab/program/commands.h"
#include "tests/lab/program/rows.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::app {
namespace {

using report::nothing;
using report::number;
using report::words;
using studies::Mismatch;
namespace fs = std::filesystem;

struct SequenceCommand {
  fs::path data = "../shared/data";
  std::string preset = "balanced";
  double noise = 0.0;
  DeviceOptions device;
  RowFiles rows;
};

template <class T>
T got(Result<T> result) {
  if (!result) throw Mismatch(result.error().message);
  return std::move(*result);
}

struct Data {
  std::string name;
  files::SequenceReader reader;
  std::vector<double> times_s;
  /// Points followed through all frames; or label volumes, one per frame.
  std::vector<std::vector<glm::dvec3>> points_mm;
  std::vector<Volume> labels;
};

Data open(const std::string& name, const std::vector<fs::path>& inputs) {
  Data data{name, got(files::SequenceReader::open(inputs)), {}, {}, {}};
  data.times_s = data.reader.times_s();
  return data;
}

Data breathing(const fs::path& shared) {
  Data data = open("breathing", {shared / "lung/breathing.seq.nrrd"});
  for (size_t k = 0; k < data.reader.frame_count(); ++k)
    data.points_mm.push_back(
        got(files::read_followed_points(shared / "lung/breathing_points.csv", int(k)))
            .points_lps_mm);
  return data;
}

Data cine(const fs::path& shared) {
  std::vector<fs::path> frames;
  for (int k = 0; k < 20; ++k)
    frames.push_back(shared / fmt::format("heart_cine/frame_{:02}.mha", k));
  Data data = open("heart_cine", frames);
  for (int k = 0; k < 20; ++k)
    data.labels.push_back(
        got(files::read_volume(shared / fmt::format("heart_cine/lv_{:02}.mha", k))));
  return data;
}

/// The place in one frame of the material at x of another.
using Follow = std::function<glm::dvec3(size_t from, size_t to, glm::dvec3 x)>;

/// Mean distance to the known places over all ordered pairs, mm.
double all_pairs_mm(const Data& data, const Follow& follow) {
  double sum = 0.0;
  size_t count = 0;
  const size_t frames = data.points_mm.size();
  for (size_t a = 0; a < frames; ++a)
    for (size_t b = 0; b < frames; ++b) {
      if (a == b) continue;
      for (size_t p = 0; p < data.points_mm[a].size(); ++p) {
        sum += glm::distance(follow(a, b, data.points_mm[a][p]), data.points_mm[b][p]);
        ++count;
      }
    }
  return sum / double(count);
}

/// The label with the largest interpolated share.
int label_at(const Volume& labels, glm::dvec3 lps_mm) {
  const glm::dvec3 at = labels.grid.index_from_lps(lps_mm);
  double shares[3] = {};
  for (int c = 0; c < 8; ++c) {
    glm::ivec3 corner(glm::floor(at));
    double weight = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double share = at[axis] - std::floor(at[axis]);
      const int up = c >> axis & 1;
      corner[axis] = std::clamp(corner[axis] + up, 0, labels.grid.size[axis] - 1);
      weight *= up ? share : 1.0 - share;
    }
    const int label = int(labels.at(corner.x, corner.y, corner.z));
    if (label >= 0 && label < 3) shares[label] += weight;
  }
  return int(std::max_element(shares, shares + 3) - shares);
}

struct Dice {
  double pool = 0.0, myocardium = 0.0;
};

/// Mean over all ordered pairs, slices 2 to 12 (in which the labels follow the borders).
Dice all_pairs_dice(const Data& data, const Follow& follow) {
  Dice sum;
  const size_t frames = data.labels.size();
  for (size_t a = 0; a < frames; ++a)
    for (size_t b = 0; b < frames; ++b) {
      if (a == b) continue;
      double both[3] = {}, all[3] = {};
      const Grid& grid = data.labels[a].grid;
      for (int k = 2; k <= 12; ++k)
        for (int j = 0; j < grid.size.y; ++j)
          for (int i = 0; i < grid.size.x; ++i) {
            const glm::dvec3 x = grid.lps_from_index({i, j, k});
            const int here = int(data.labels[a].at(i, j, k));
            const int carried = label_at(data.labels[b], follow(a, b, x));
            ++all[here];
            ++all[carried];
            if (here == carried) both[here] += 2.0;
          }
      sum.pool += both[2] / all[2];
      sum.myocardium += both[1] / all[1];
    }
  const double pairs = double(frames * (frames - 1));
  return {sum.pool / pairs, sum.myocardium / pairs};
}

Field composed(const Field& first, const Field& then) {
  Field result = first;
  for (int k = 0; k < result.grid.size.z; ++k)
    for (int j = 0; j < result.grid.size.y; ++j)
      for (int i = 0; i < result.grid.size.x; ++i) {
        const size_t n = result.grid.offset(i, j, k);
        const glm::dvec3 x = result.grid.lps_from_index({i, j, k});
        const glm::dvec3 u(first.u_mm[n]);
        result.u_mm[n] = glm::vec3(u + sample_at_lps(then, x + u));
      }
  return result;
}

/// From any frame to any other through the material's reference: phi_to(phi_from^-1(x)). The
/// inverse on the fields' coarse grid is only the start of the search.
Follow follow_of(const std::vector<Field>& at_frame, const std::vector<Field>& inverse) {
  return [&](size_t from, size_t to, glm::dvec3 x) {
    glm::dvec3 material = x + sample_at_lps(inverse[from], x);
    for (int step = 0; step < 30; ++step) {
      const glm::dvec3 next = x - sample_at_lps(at_frame[from], material);
      const bool done = glm::distance(next, material) < 1e-4;
      material = next;
      if (done) break;
    }
    return material + sample_at_lps(at_frame[to], material);
  };
}

report::Table motions_table() {
  return {
      "Where the material goes",
      "Over all ordered pairs of frames: distance to the known places of 400 points, or Dice of "
      "the labels. Folds at 64 phases of the cycle; drift after it.",
      {{"data", "data"},
       {"motion", "motion"},
       {"all_pairs_mm", "all pairs, mm"},
       {"dice_pool", "Dice pool"},
       {"dice_myocardium", "Dice myocardium"},
       {"folded", "folded samples"},
       {"least_determinant", "least det"},
       {"not_inverted", "not inverted"},
       {"harmonics", "harmonics"},
       {"drift_mm", "drift, mm"},
       {"reference", "reference"},
       {"seconds", "s"}},
      {}};
}

/// A row without drift and seconds, which do not depend on this motion alone.
std::vector<report::Cell> motion_row(const Data& data, const std::string& model,
                                     const SequenceMotion& motion) {
  std::vector<Field> inverse;
  size_t unconverged = 0;
  std::vector<Field> at_frame;
  for (size_t k = 0; k < motion.frames(); ++k) at_frame.push_back(motion.at_frame(k));
  for (const Field& field : at_frame) {
    Inverse found = inverse_of(field, field.grid);
    unconverged += found.unconverged;
    inverse.push_back(std::move(found.w));
  }
  const Follow follow = follow_of(at_frame, inverse);
  double least_det = 1.0;
  size_t folded = 0;
  const double end_s =
      motion.basis.cycle_s > 0.0 ? motion.basis.cycle_s : motion.basis.times_s.back();
  constexpr int kPhases = 64;
  for (int p = 0; p < kPhases; ++p) {
    const Folds found = folds(motion.at(end_s * p / kPhases));
    folded += found.folded;
    least_det = std::min(least_det, found.min_det);
  }
  std::vector<report::Cell> row = {words(data.name), words(model)};
  row.push_back(data.points_mm.empty() ? nothing() : number(all_pairs_mm(data, follow), 3));
  if (data.labels.empty()) {
    row.insert(row.end(), 2, nothing());
  } else {
    const Dice dice = all_pairs_dice(data, follow);
    row.insert(row.end(), {number(dice.pool, 4), number(dice.myocardium, 4)});
  }
  row.insert(row.end(), {number(double(folded), 0), number(least_det, 2),
                         number(double(unconverged), 0), number(motion.basis.harmonics, 0),
                         nothing(), number(double(motion.reference), 0), nothing()});
  return row;
}

/// How often the haptic loop's Newton method does not find the material of a place, over the whole
/// volume and cycle: cold from the place itself, and warm from its place a millisecond before.
report::Table inverting_table(const Data& data, const SequenceMotion& motion) {
  const auto map = SequenceMap::of(motion);
  const Grid& grid = data.reader.grid();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const double end_s =
      motion.basis.cycle_s > 0.0 ? motion.basis.cycle_s : motion.basis.times_s.back();
  size_t cold = 0, warm = 0, steps = 0, folded = 0, far = 0;
  constexpr size_t kTargets = 200'000;
  for (size_t n = 0; n < kTargets; ++n) {
    const glm::dvec3 index =
        glm::dvec3(share(random), share(random), share(random)) * glm::dvec3(grid.size - 1);
    const glm::dvec3 target = volume_from_lps(grid.lps_from_index(index));
    const double t = end_s * share(random);
    SequenceSnapshot moment(*map, motion.basis.at(t));
    const BackTrack first = back_track(moment, target, target);
    steps += size_t(first.steps);
    cold += !first.ok;
    if (!first.ok) {
      const bool close = first.residual_m <= 1e-6 * map->cell_m();
      folded += close;
      far += !close;
      continue;
    }
    moment.set(motion.basis.at(t + 0.001));
    warm += !back_track(moment, target, first.x_m).ok;
  }
  const auto count = [](size_t n) { return number(double(n), 0); };
  return {
      "Inverting it as the hand does: " + data.name,
      fmt::format("Of {} places in the whole volume and cycle, how many are not found: cold from "
                  "the place itself, and warm from where it was a millisecond before.",
                  kTargets),
      {{"cold", "cold"},
       {"beyond_fold", "beyond a fold"},
       {"not_met", "not met"},
       {"warm", "warm"},
       {"steps_cold", "steps cold"},
       {"least_determinant", "least det"}},
      {{count(cold), count(folded), count(far), count(warm), number(double(steps) / kTargets, 2),
        number(map->least_determinant(), 2)}}};
}

/// The distance between picture and hand: the picture interpolates linearly between the samples of
/// the motion, the hand uses its spline. Voxels of the frames.
std::vector<report::Cell> picture_row(const Data& data, const SequenceMotion& motion, int factor) {
  const auto map = SequenceMap::of(motion);
  const SequenceMap::Samples samples = map->samples(factor);
  const size_t count = samples.u_m.size() / motion.basis.summands();
  std::mt19937 random(2);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const double end_s =
      motion.basis.cycle_s > 0.0 ? motion.basis.cycle_s : motion.basis.times_s.back();
  Grid grid = motion.terms.front().grid;
  grid.spacing_mm /= double(factor);
  grid.size = samples.place.size;
  std::vector<double> voxels;
  for (int look = 0; look < 20; ++look) {
    const TimeWeights time = motion.basis.at(end_s * share(random));
    Field now = still_field(grid);
    for (size_t s = 0; s < count; ++s)
      for (int n = 0; n < time.count; ++n)
        now.u_mm[s] += time.weight[size_t(n)] *
                       glm::vec3(lps_from_volume(
                           glm::dvec3(samples.u_m[size_t(time.term[size_t(n)]) * count + s])));
    for (int trial = 0; trial < 10'000; ++trial) {
      const glm::dvec3 lps_mm = grid.lps_from_index(
          glm::dvec3(share(random), share(random), share(random)) * glm::dvec3(grid.size - 1));
      const glm::dvec3 hand_m = map->displacement(volume_from_lps(lps_mm), time);
      voxels.push_back(glm::distance(lps_from_volume(hand_m), sample_at_lps(now, lps_mm)) /
                       data.reader.grid().finest_mm());
    }
  }
  std::sort(voxels.begin(), voxels.end());
  const auto at = [&](size_t percent) { return number(voxels[voxels.size() * percent / 100], 4); };
  return {words(data.name), words(factor == 1 ? "at the samples" : "twice as fine"),
          at(50),           at(95),
          at(99),           number(voxels.back(), 4)};
}

report::Table picture_table(const Data& data, const SequenceMotion& motion) {
  return {
      "How far picture and hand are apart: " + data.name,
      "The picture reads trilinear between samples of the motion, the hand its spline. Voxels of "
      "the frames.",
      {{"data", "data"},
       {"samples", "samples"},
       {"median_voxels", "median"},
       {"p95_voxels", "p95"},
       {"p99_voxels", "p99"},
       {"most_voxels", "most"}},
      {picture_row(data, motion, 1), picture_row(data, motion, 2)}};
}

SequenceMotionOptions options_of(const std::string& preset) {
  SequenceMotionOptions options;
  options.estimator.motion = *motion_preset(preset);
  options.estimator.cyclic = true;
  return options;
}

void measure(const std::shared_ptr<vulkan::Context>& context, Data& data, const std::string& preset,
             Rows& rows) {
  std::optional<SequenceMotion> motion;
  rows.add([&] {
    std::vector<Field> consecutive(data.times_s.size());
    const double start = studies::now_s();
    motion = got(estimate_sequence_motion(
        context, data.reader.grid(), data.times_s, [&](size_t k) { return data.reader.frame(k); },
        options_of(preset), [&](PairMotion pair) { consecutive[pair.fixed_frame] = pair.field; }));
    const double took_s = studies::now_s() - start;
    // As in the paper: chained, from frame 0.
    SequenceMotion chain = *motion;
    chain.reference = 0;
    chain.basis.harmonics = 0;
    chain.terms = {still_field(consecutive[0].grid)};
    for (size_t k = 0; k + 1 < data.times_s.size(); ++k)
      chain.terms.push_back(composed(chain.terms[k], consecutive[k]));
    report::Table table = motions_table();
    table.title += ": " + data.name;
    table.rows = {motion_row(data, "consecutive", chain), motion_row(data, "sequence", *motion)};
    table.rows[0].at(9) = number(got(cycle_drift(consecutive, data.reader.grid())).mm.mean, 3);
    table.rows[1].at(11) = number(took_s, 1);
    return table;
  });
  rows.add([&] { return inverting_table(data, *motion); });
  rows.add([&] { return picture_table(data, *motion); });
}

/// The motion from the means of 1 to 8 cycles with new noise each time, as the motion of a live
/// cycle is estimated (module/session/live_sequence.h). `noise`: its standard deviation as a
/// fraction of that of frame 0's values.
report::Table cycles_table(const std::shared_ptr<vulkan::Context>& context, Data& data,
                           const std::string& preset, double noise) {
  std::vector<Volume> frames, means;
  for (size_t k = 0; k < data.times_s.size(); ++k) frames.push_back(got(data.reader.frame(k)));
  double sum = 0.0, squares = 0.0;
  for (const float v : frames[0].values) {
    sum += double(v);
    squares += double(v) * double(v);
  }
  const double count = double(frames[0].values.size());
  const double sd = std::sqrt(squares / count - sum / count * (sum / count));
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0.0F, float(noise * sd));
  SequenceMotionOptions options = options_of(preset);
  means = frames;
  report::Table table = motions_table();
  table.title += fmt::format(" in noise of {:g}: {}", noise, data.name);
  for (int cycles = 1; cycles <= 8; ++cycles) {
    for (size_t k = 0; k < frames.size(); ++k)
      for (size_t v = 0; v < frames[k].values.size(); ++v) {
        const float one = frames[k].values[v] + normal(random);
        float& mean = means[k].values[v];
        mean = cycles == 1 ? one : mean + (one - mean) / float(cycles);
      }
    // 1, 2, 4 and 8 cycles only.
    if ((cycles & (cycles - 1)) != 0) continue;
    const auto motion = got(estimate_sequence_motion(
        context, data.reader.grid(), data.times_s,
        [&](size_t k) -> Result<Volume> { return means[k]; }, options));
    options.reference = motion.reference;
    table.rows.push_back(
        motion_row(data, fmt::format("{} cycle{}", cycles, cycles == 1 ? "" : "s"), motion));
  }
  return table;
}

int run(const SequenceCommand& command) {
  Console console(false, false);
  if (const Status can = check_can_write(command.rows); !can) return fail(console, can.error());
  const auto context = open_device(command.device, console);
  if (!context) return fail(console, context.error());
  Rows rows("sequence --preset " + command.preset, context->get());
  for (auto* make : {&breathing, &cine}) {
    Data data = (*make)(command.data);
    if (command.noise > 0.0)
      rows.add([&] { return cycles_table(*context, data, command.preset, command.noise); });
    else
      measure(*context, data, command.preset, rows);
  }
  const Status written = rows.write(command.rows);
  return written ? int(kExitOk) : fail(console, written.error());
}

}  // namespace

Command add_sequence(CLI::App& program) {
  auto command = std::make_shared<SequenceCommand>();
  CLI::App* app = program.add_subcommand(
      "sequence", "Measure the motion of whole sequences: breathing CT, beating heart");
  app->add_option("--data", command->data, "Folder with lung/ and heart_cine/")
      ->type_name("DIR")
      ->capture_default_str();
  app->add_option("--preset", command->preset, "Of every pair")
      ->check(one_of_the_presets())
      ->capture_default_str();
  app->add_option("--noise", command->noise,
                  "Only the motion from 1 to 8 cycles with noise of this standard deviation, as a "
                  "share of the values' own")
      ->check(number_in({0.0, 100.0}));
  add_device_options(*app, command->device);
  add_row_options(*app, command->rows);
  return {app,
          [command] { return measured([&] { return run(*command); }); },
          {"--data"},
          row_outputs(),
          {}};
}

}  // namespace palpate::app
