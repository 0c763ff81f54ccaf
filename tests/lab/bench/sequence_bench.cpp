// How well one motion for a whole sequence tells where the material goes, beside fields that follow
// each other: on the breathing CT against the known motion of 400 points, over all ordered pairs of
// frames; on the beating heart by the Dice overlap of the left ventricle's labels, carried from
// every frame to every other. Both: drift over the cycle, folds at the frames and between them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <optional>
#include <random>

#include "compute/motion/estimate_sequence.h"
#include "compute/motion/quality.h"
#include "compute/motion/quality_inverse.h"
#include "compute/vulkan/context.h"
#include "integration/files/landmarks.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "module/haptics/back_track.h"

namespace {

using namespace palpate;
namespace fs = std::filesystem;

struct Data {
  std::string name;
  files::SequenceReader reader;
  std::vector<double> times_s;
  /// Points followed through all frames; or label volumes, one per frame.
  std::vector<std::vector<glm::dvec3>> points_mm;
  std::vector<Volume> labels;
};

std::optional<Data> open(const std::string& name, const std::vector<fs::path>& inputs) {
  auto reader = files::SequenceReader::open(inputs);
  if (!reader) {
    fmt::print(stderr, "sequence_bench: {}\n", reader.error().message);
    return std::nullopt;
  }
  Data data{name, std::move(*reader), {}, {}, {}};
  data.times_s = data.reader.times_s();
  return data;
}

std::optional<Data> breathing(const fs::path& shared) {
  auto data = open("breathing", {shared / "lung/breathing.seq.nrrd"});
  if (!data) return data;
  for (size_t k = 0; k < data->reader.frame_count(); ++k) {
    const auto points = files::read_followed_points(shared / "lung/breathing_points.csv", int(k));
    if (!points) return std::nullopt;
    data->points_mm.push_back(points->points_lps_mm);
  }
  return data;
}

std::optional<Data> cine(const fs::path& shared) {
  std::vector<fs::path> frames;
  for (int k = 0; k < 20; ++k)
    frames.push_back(shared / fmt::format("heart_cine/frame_{:02}.mha", k));
  auto data = open("heart_cine", frames);
  if (!data) return data;
  for (int k = 0; k < 20; ++k) {
    auto label = files::read_volume(shared / fmt::format("heart_cine/lv_{:02}.mha", k));
    if (!label) return std::nullopt;
    data->labels.push_back(std::move(*label));
  }
  return data;
}

/// Where the material at x of a frame is in another.
using Follow = std::function<glm::dvec3(size_t from, size_t to, glm::dvec3 x)>;

/// Mean over all ordered pairs of the distance to the known places, mm.
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

/// The largest of the interpolated shares of each label.
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

/// Mean over all ordered pairs, slices 2 to 12 (where the labels follow the borders).
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
/// inverse on the fields' coarse grid is only where the search starts.
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

void tell(const Data& data, const std::string& model, const SequenceMotion& motion) {
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
  std::string score;
  if (!data.points_mm.empty())
    score = fmt::format("all pairs {:.3f} mm", all_pairs_mm(data, follow));
  if (!data.labels.empty()) {
    const Dice dice = all_pairs_dice(data, follow);
    score = fmt::format("Dice pool {:.4f}, myocardium {:.4f}", dice.pool, dice.myocardium);
  }
  fmt::print(
      "{:<11} {:<24} {}; folded samples at {} phases {}, least det {:.2f}; not inverted {}; "
      "harmonics {}\n",
      data.name, model, score, kPhases, folded, least_det, unconverged, motion.basis.harmonics);
  std::fflush(stdout);
}

/// How often the hand's Newton does not find where the material of a place is, over the whole
/// volume and cycle: cold from the place itself, and warm from where it was a millisecond before.
void tell_inverting(const Data& data, const SequenceMotion& motion) {
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
    SequenceMoment moment(*map, motion.basis.at(t));
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
  fmt::print(
      "{:<11} {:<24} of {} places not found: cold {} ({} beyond a fold, {} not met), warm {}; "
      "{:.2f} "
      "steps cold; least det {:.2f}\n",
      data.name, "inverting", kTargets, cold, folded, far, warm, double(steps) / kTargets,
      map->least_determinant());
}

/// How far apart picture and hand are: the picture reads trilinear between the samples of the
/// motion, the hand its spline. Voxels of the frames.
void tell_picture(const Data& data, const SequenceMotion& motion, int factor) {
  const auto map = SequenceMap::of(motion);
  const SequenceMap::Samples samples = map->samples(factor);
  const size_t count = samples.u_m.size() / motion.terms.size();
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
  fmt::print("{:<11} {:<24} {}: median {:.4f}, p95 {:.3f}, p99 {:.3f}, most {:.3f} voxels apart\n",
             data.name, "picture and hand", factor == 1 ? "at the samples" : "twice as fine",
             voxels[voxels.size() / 2], voxels[voxels.size() * 95 / 100],
             voxels[voxels.size() * 99 / 100], voxels.back());
}

void measure(const std::shared_ptr<vulkan::Context>& context, Data& data,
             const std::string& preset) {
  const FrameReader read = [&](size_t k) { return data.reader.frame(k); };
  SequenceMotionOptions options;
  options.estimator.motion = *motion_preset(preset);
  options.estimator.cyclic = true;
  std::vector<Field> consecutive(data.times_s.size());
  const auto start = std::chrono::steady_clock::now();
  const auto motion = estimate_sequence_motion(
      context, data.reader.grid(), data.times_s, read, options,
      [&](PairMotion pair) { consecutive[pair.fixed_frame] = pair.field; });
  if (!motion) {
    fmt::print(stderr, "sequence_bench: {}\n", motion.error().message);
    return;
  }
  const double took_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  // The paper's: one after the other, from frame 0.
  SequenceMotion chain = *motion;
  chain.reference = 0;
  chain.basis.harmonics = 0;
  chain.terms = {still_field(consecutive[0].grid)};
  for (size_t k = 0; k + 1 < data.times_s.size(); ++k)
    chain.terms.push_back(composed(chain.terms[k], consecutive[k]));
  tell(data, "consecutive", chain);
  const auto drift = cycle_drift(consecutive, data.reader.grid());
  if (drift)
    fmt::print("{:<11} {:<24} drift over the cycle {:.3f} mm\n", data.name, "consecutive",
               drift->mm.mean);
  tell(data, "sequence", *motion);
  tell_inverting(data, *motion);
  for (const int factor : {1, 2}) tell_picture(data, *motion, factor);
  fmt::print("{:<11} {:<24} reference {}, {:.1f} s\n", data.name, "sequence", motion->reference,
             took_s);
}

/// The motion from the means of 1 to 8 cycles whose frames have other noise each time, as a live
/// cycle's is found (module/session/live_sequence.h). `noise`: its standard deviation as a share of
/// that of frame 0's values.
void measure_cycles(const std::shared_ptr<vulkan::Context>& context, Data& data,
                    const std::string& preset, double noise) {
  std::vector<Volume> frames, means;
  for (size_t k = 0; k < data.times_s.size(); ++k) {
    auto frame = data.reader.frame(k);
    if (!frame) return fmt::print(stderr, "sequence_bench: {}\n", frame.error().message);
    frames.push_back(std::move(*frame));
  }
  double sum = 0.0, squares = 0.0;
  for (const float v : frames[0].values) {
    sum += double(v);
    squares += double(v) * double(v);
  }
  const double count = double(frames[0].values.size());
  const double sd = std::sqrt(squares / count - sum / count * (sum / count));
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0.0F, float(noise * sd));
  SequenceMotionOptions options;
  options.estimator.motion = *motion_preset(preset);
  options.estimator.cyclic = true;
  means = frames;
  for (int cycles = 1; cycles <= 8; ++cycles) {
    for (size_t k = 0; k < frames.size(); ++k)
      for (size_t v = 0; v < frames[k].values.size(); ++v) {
        const float one = frames[k].values[v] + normal(random);
        float& mean = means[k].values[v];
        mean = cycles == 1 ? one : mean + (one - mean) / float(cycles);
      }
    if ((cycles & (cycles - 1)) != 0) continue;  // 1, 2, 4, 8
    const auto motion = estimate_sequence_motion(
        context, data.reader.grid(), data.times_s,
        [&](size_t k) -> Result<Volume> { return means[k]; }, options);
    if (!motion) return fmt::print(stderr, "sequence_bench: {}\n", motion.error().message);
    options.reference = motion->reference;
    tell(data, fmt::format("{} cycle{} in noise", cycles, cycles == 1 ? "" : "s"), *motion);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures the motion of whole sequences on the breathing CT and the beating heart.");
  std::string shared = PALPATE_SHARED_DATA, preset = "balanced";
  app.add_option("--data", shared, "Folder with lung/ and heart_cine/")->capture_default_str();
  app.add_option("--preset", preset, "Of every pair")->capture_default_str();
  double noise = 0.0;
  app.add_option("--noise", noise,
                 "Only the motion from 1 to 8 cycles with noise of this standard deviation, as a "
                 "share of the values' own");
  CLI11_PARSE(app, argc, argv);
  const auto context = vulkan::Context::open({});
  if (!context) {
    fmt::print(stderr, "sequence_bench: {}\n", context.error().message);
    return 1;
  }
  for (auto* make : {&breathing, &cine})
    if (auto data = (*make)(shared))
      noise > 0.0 ? measure_cycles(*context, *data, preset, noise)
                  : measure(*context, *data, preset);
  return 0;
}
