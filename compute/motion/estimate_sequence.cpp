#include "compute/motion/estimate_sequence.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numeric>
#include <string>
#include <string_view>

#include "compute/motion/plan.h"
#include "compute/motion/quality_inverse.h"
#include "compute/volume/parallel.h"

namespace palpate {
namespace {

/// The strongest edges of the reference frame, at which the values' steadiness is measured.
constexpr double kEdgeShare = 0.05;
constexpr size_t kMostEdgePoints = 40'000;
/// Smallest weight of a field: where no frame has confidence, neighbours still agree.
constexpr float kLeastWeight = 0.05F;
/// Rounds of (1 2 1)/4 over the weights, an SD of 1.7 cells: where fields differ, a weight that
/// jumps from cell to cell would make the mean jump too, and fold.
constexpr int kWeightRounds = 6;
/// A step from the last frame to the first that is more than this many times the largest other one
/// does not close a cycle: a movement to one side in N equal steps would need N - 1 of them.
constexpr double kLargestClosingStep = 3.0;
/// Of a coarse motion, which misses more of the longest way: half a beat of a small phantom
/// has 2.6.
constexpr double kLargestCoarseClosingStep = 2.0;
/// If the last frame repeats the first, the cycle ends this share of a step after it, since all
/// times must lie within the cycle.
constexpr double kRepeatedEnd = 1e-3;
constexpr size_t kCoarseLevel = 2;  // of the pyramid, 0 is the frames' own
constexpr TimeWeights kHalfOfEach{2, {0, 1}, {0.5F, 0.5F}};

/// Calls work(n, lps_mm) for every sample of a grid, on all cores.
template <class Work>
void for_each_sample(const Grid& grid, double cost, const Work& work) {
  parallel_ranges(grid.size.z, cost * grid.size.x * grid.size.y, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i)
          work(grid.offset(i, j, k), grid.lps_from_index({i, j, k}));
  });
}

/// The weights of a frame's field: its confidence, smoothed, and at least kLeastWeight.
std::vector<float> weights_of(const Confidence& confidence) {
  const glm::ivec3 size = confidence.grid.size;
  std::vector<float> weights = confidence.values;
  std::vector<float> before;
  for (int round = 0; round < kWeightRounds; ++round) {
    size_t stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
      before = weights;
      const auto along = size_t(size[axis]);
      for (size_t n = 0; n < weights.size(); ++n) {
        const size_t at = n / stride % along;
        const float low = before[at > 0 ? n - stride : n];
        const float high = before[at + 1 < along ? n + stride : n];
        weights[n] = 0.25F * low + 0.5F * before[n] + 0.25F * high;
      }
      stride *= along;
    }
  }
  for (float& weight : weights) weight = std::max(kLeastWeight, weight);
  return weights;
}

/// Solves A x = b for symmetric positive definite A (n x n, row by row) and many right-hand sides
/// at once: b has n rows. Gauss-Jordan with pivots; n is below a few dozen.
void solve_in_place(std::vector<double> a, std::vector<double>& b, size_t n, size_t columns) {
  for (size_t p = 0; p < n; ++p) {
    size_t best = p;
    for (size_t r = p + 1; r < n; ++r)
      if (std::abs(a[r * n + p]) > std::abs(a[best * n + p])) best = r;
    for (size_t c = 0; c < n; ++c) std::swap(a[p * n + c], a[best * n + c]);
    for (size_t c = 0; c < columns; ++c) std::swap(b[p * columns + c], b[best * columns + c]);
    const double pivot = a[p * n + p];
    for (size_t r = 0; r < n; ++r) {
      const double factor = r == p ? 0.0 : a[r * n + p] / pivot;
      if (factor == 0.0) continue;
      for (size_t c = 0; c < n; ++c) a[r * n + c] -= factor * a[p * n + c];
      for (size_t c = 0; c < columns; ++c) b[r * columns + c] -= factor * b[p * columns + c];
    }
  }
  for (size_t r = 0; r < n; ++r)
    for (size_t c = 0; c < columns; ++c) b[r * columns + c] /= a[r * n + r];
}

/// Fields at the frames of the motion with the harmonics of `basis`.
std::vector<Field> smoothed(std::span<const Field> at_frame, const TimeBasis& basis) {
  const std::vector<Field> terms = harmonics_of(at_frame, basis);
  std::vector<Field> result;
  for (size_t k = 0; k < at_frame.size(); ++k)
    result.push_back(combined(terms, basis.at(int(k), 0.0)));
  return result;
}

/// How steady the values at material points on edges are through the cycle. A gain or bias that
/// drifts (inflow in cine MR, contrast) is no error of the motion: only the difference of each
/// point's value from the mean of the frames before and after counts.
class Steadiness {
 public:
  explicit Steadiness(const Volume& reference) {
    const Grid& grid = reference.grid;
    std::vector<std::pair<float, size_t>> edges;
    // The outermost slices are left out where there are others.
    const int rim = grid.size.z < 3 ? 0 : 1;
    for (int k = rim; k < grid.size.z - rim; ++k)
      for (int j = 1; j + 1 < grid.size.y; ++j)
        for (int i = 1; i + 1 < grid.size.x; ++i) {
          const float x = reference.at(i + 1, j, k) - reference.at(i - 1, j, k);
          const float y = reference.at(i, j + 1, k) - reference.at(i, j - 1, k);
          edges.emplace_back(x * x + y * y, grid.offset(i, j, k));
        }
    const size_t kept = size_t(kEdgeShare * double(edges.size()));
    std::nth_element(edges.begin(), edges.begin() + ptrdiff_t(kept), edges.end(), std::greater<>());
    edges.resize(kept);
    // nth_element leaves an order that depends on the library; sorted, the points are the same
    // everywhere.
    std::sort(edges.begin(), edges.end(),
              [](const auto& a, const auto& b) { return a.second < b.second; });
    const size_t stride = std::max<size_t>(1, kept / kMostEdgePoints);
    for (size_t e = 0; e < kept; e += stride) {
      const size_t at = edges[e].second;
      const int i = int(at % size_t(grid.size.x)),
                j = int(at / size_t(grid.size.x) % size_t(grid.size.y)),
                k = int(at / (size_t(grid.size.x) * size_t(grid.size.y)));
      points_mm_.push_back(grid.lps_from_index({i, j, k}));
    }
  }

  bool has_points() const { return !points_mm_.empty(); }

  /// Root mean square over points and frames; frames are read once each, for all candidates.
  Result<std::vector<double>> of(const std::vector<std::vector<Field>>& candidates,
                                 const FrameReader& read) const {
    const size_t frames = candidates.front().size();
    std::vector<std::vector<float>> values(candidates.size(),
                                           std::vector<float>(points_mm_.size() * frames));
    for (size_t k = 0; k < frames; ++k) {
      const auto frame = read(k);
      if (!frame) return frame.error();
      for (size_t c = 0; c < candidates.size(); ++c)
        for (size_t p = 0; p < points_mm_.size(); ++p) {
          const glm::dvec3 x = points_mm_[p] + sample_at_lps(candidates[c][k], points_mm_[p]);
          values[c][p * frames + k] = float(sample(*frame, frame->grid.index_from_lps(x)));
        }
    }
    std::vector<double> result;
    for (const std::vector<float>& of_candidate : values) {
      double sum = 0.0;
      for (size_t p = 0; p < points_mm_.size(); ++p)
        for (size_t k = 0; k < frames; ++k) {
          const float* v = &of_candidate[p * frames];
          const double difference =
              v[k] - 0.5 * (double(v[(k + 1) % frames]) + v[(k + frames - 1) % frames]);
          sum += difference * difference;
        }
      result.push_back(std::sqrt(sum / std::max(1.0, double(points_mm_.size() * frames))));
    }
    return result;
  }

 private:
  std::vector<glm::dvec3> points_mm_;
};

/// Mean length of a field, weighted by its confidence, mm.
double step_mm(const Field& field, const Confidence& confidence) {
  double sum = 0.0, all = 0.0;
  for (size_t n = 0; n < field.u_mm.size(); ++n) {
    const double w = confidence.values.empty() ? 1.0 : double(confidence.values[n]);
    sum += w * double(glm::length(field.u_mm[n]));
    all += w;
  }
  return all > 0.0 ? sum / all : 0.0;
}

/// The settings of a coarse motion: those of `fast` above its finest level, on finer cells.
MotionOptions coarse_options() {
  MotionOptions options = without_sliding_step(*motion_preset("fast"));
  options.levels.erase(options.levels.begin());
  for (LevelOptions& level : options.levels) level.cell = 2;
  options.yield.window = 0.0;
  return options;
}

/// The means over blocks of `block` voxels, on the grid of these blocks. Beyond the end of the
/// frame there is nothing to count.
Volume block_means(const Volume& frame, glm::ivec3 block, const Grid& onto) {
  Volume means{onto, std::vector<float>(onto.count())};
  parallel_ranges(onto.size.z, double(frame.values.size()) / onto.size.z, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < onto.size.y; ++j)
        for (int i = 0; i < onto.size.x; ++i) {
          const glm::ivec3 low = glm::ivec3(i, j, k) * block;
          const glm::ivec3 high = glm::min(low + block, frame.grid.size);
          double sum = 0.0;
          for (int c = low.z; c < high.z; ++c)
            for (int b = low.y; b < high.y; ++b)
              for (int a = low.x; a < high.x; ++a) sum += double(frame.at(a, b, c));
          const glm::ivec3 n = high - low;
          means.values[onto.offset(i, j, k)] = float(sum / (double(n.x) * n.y * n.z));
        }
  });
  return means;
}

/// Equal for equal frames, and for others once in 2^64.
uint64_t fingerprint(std::span<const float> values) {
  const auto bytes = std::as_bytes(values);
  return std::hash<std::string_view>()({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::string equal_frames(size_t a, size_t b) {
  return "Frames " + std::to_string(a) + " and " + std::to_string(b) +
         " are equal: nothing moves between them.";
}

/// How far a fit to all other frames is from each frame's field, rms, weighted by confidence, mm.
double left_out_mm(std::span<const Field> at_frame, std::span<const Field> fit, size_t terms,
                   std::span<const Confidence> confidence) {
  double sum = 0.0, all = 0.0;
  // The fit is linear: a fit without frame k would miss it by its residual / (1 - its own weight).
  // On the clock all frames are equally far apart, so all have the same weight.
  const double others = std::max(1e-3, 1.0 - double(terms) / double(at_frame.size()));
  for (size_t k = 0; k < at_frame.size(); ++k) {
    for (size_t n = 0; n < fit[k].u_mm.size(); ++n) {
      const double w = confidence[k].values[n];
      const double d = glm::distance(fit[k].u_mm[n], at_frame[k].u_mm[n]) / others;
      sum += w * d * d;
      all += w;
    }
  }
  return all > 0.0 ? std::sqrt(sum / all) : 0.0;
}

/// Reduces a cyclic motion that is known at its frames to as few harmonics as keep the values at
/// material points steady and predict left-out frames nearly as well as any number; unchanged if
/// none do. Each criterion alone fails: in noise the values hardly depend on the motion, and a
/// motion that is sampled too coarsely is predicted best by too few harmonics.
Status choose_harmonics(SequenceMotion& motion, const Volume& reference, const FrameReader& read,
                        const SequenceMotionOptions& options, SequenceReport& report) {
  const std::vector<Field> at_frame = motion.terms;
  std::vector<TimeBasis> bases = {motion.basis};
  std::vector<std::vector<Field>> fields = {at_frame};
  std::vector<double> left_out = {0.0};
  const int most = std::min(TimeBasis::kMostHarmonics, (int(motion.frames()) - 2) / 2);
  for (int h = 1; h <= most; ++h) {
    TimeBasis basis = motion.basis;
    basis.harmonics = h;
    fields.push_back(smoothed(at_frame, basis));
    left_out.push_back(left_out_mm(at_frame, fields.back(), basis.terms(), report.confidence));
    bases.push_back(std::move(basis));
  }
  const Steadiness of_values(reference);
  if (!of_values.has_points() || bases.size() < 2) return Nothing{};
  const auto unsteady = of_values.of(fields, read);
  if (!unsteady) return unsteady.error();
  report.unsteadiness = *unsteady;
  const double least_mm = *std::min_element(left_out.begin() + 1, left_out.end());
  for (size_t c = 1; c < bases.size(); ++c) {
    if ((*unsteady)[c] > (1.0 + options.steadiness) * (*unsteady)[0]) continue;
    if (left_out[c] > (1.0 + options.left_out) * least_mm) continue;
    motion.terms = harmonics_of(at_frame, bases[c]);
    motion.basis = bases[c];
    return Nothing{};
  }
  return Nothing{};
}

/// The times of a sequence, and its cycle, which ends where the last frame repeats the first.
TimeBasis basis_of(std::span<const double> times_s, bool cyclic, bool repeats_first) {
  TimeBasis basis;
  for (const double time_s : times_s) basis.times_s.push_back(time_s - times_s.front());
  if (cyclic) basis.cycle_s = cycle_of(times_s);
  if (cyclic && repeats_first) {
    const double end_s = basis.times_s.back();
    basis.cycle_s = end_s + kRepeatedEnd * (basis.cycle_s - end_s);
    basis.repeats_first = true;
  }
  return basis;
}

/// Whether the last of a cycle's steps, of these lengths, leads back to the first frame: it is at
/// most so many times the largest other one.
bool is_closed(std::span<const double> steps_mm, double most) {
  return steps_mm.back() <= most * *std::max_element(steps_mm.begin(), steps_mm.end() - 1);
}

/// The fields from the reference frame to all frames, and their confidence.
struct DirectFields {
  std::vector<Field> fields;
  std::vector<Confidence> confidence;
};

/// on_done is called after each field, on_progress with the moving frame and its share.
Result<DirectFields> direct_fields(const std::shared_ptr<vulkan::Context>& context,
                                   const Grid& grid, size_t frames, size_t reference,
                                   const FrameReader& read, EstimatorOptions options,
                                   std::stop_token stop, const std::function<void()>& on_done,
                                   const std::function<void(size_t, double)>& on_progress) {
  DirectFields direct{std::vector<Field>(frames), std::vector<Confidence>(frames)};
  options.cyclic = false;
  options.from_first = true;
  // The reference is pushed as frame 0, frame k as k + 1.
  auto estimator = SequenceEstimator::open(
      context, grid, options,
      [&](PairMotion pair) {
        direct.fields[pair.moving_frame - 1] = std::move(pair.field);
        direct.confidence[pair.moving_frame - 1] = std::move(pair.confidence);
        on_done();
      },
      [&](size_t, size_t moving, double share) { on_progress(moving - 1, share); });
  if (!estimator) return estimator.error();
  const std::stop_callback on_stop(stop, [&] { (*estimator)->cancel(); });
  Status pushed = Nothing{};
  const auto push = [&](size_t as, size_t k) {
    const auto frame = read(k);
    pushed = frame ? (*estimator)->push(as, *frame) : Status(frame.error());
  };
  push(0, reference);
  for (size_t k = 0; k < frames && pushed && !stop.stop_requested(); ++k)
    if (k != reference) push(k + 1, k);
  if (!pushed) (*estimator)->cancel();
  const Status finished = (*estimator)->finish();
  if (!pushed && pushed.error().kind != ErrorKind::kCancelled) return pushed.error();
  if (!finished) return finished.error();
  const Grid& solved = direct.fields[reference == 0 ? 1 : 0].grid;
  direct.fields[reference] = still_field(solved);
  direct.confidence[reference] = {solved,
                                  std::vector<float>(solved.count(), 1.0F),
                                  {solved, std::vector<glm::vec2>(solved.count())}};
  return direct;
}

/// The motion from each frame to the next.
struct ConsecutiveFields {
  std::vector<Field> fields;       ///< in a cycle also from the last frame to the first
  std::vector<double> lengths_mm;  ///< step_mm() of each
  bool repeats_first = false;      ///< the last frame has the values of the first
};

/// Estimates them while the frames are read. Equal frames become notes. Errors: as those of the
/// estimator and of `read`; kCancelled after a stop.
Result<ConsecutiveFields> consecutive_fields(
    const std::shared_ptr<vulkan::Context>& context, const Grid& grid, size_t frames,
    const FrameReader& read, const EstimatorOptions& options, const std::stop_token& stop,
    const SequenceEstimator::OnMotion& on_pair, const SequenceEstimator::OnProgress& on_share,
    std::vector<std::string>& notes) {
  ConsecutiveFields steps;
  steps.fields.resize(frames - (options.cyclic ? 0 : 1));
  steps.lengths_mm.resize(steps.fields.size());
  Result<std::unique_ptr<SequenceEstimator>> estimator = SequenceEstimator::open(
      context, grid, options,
      [&](PairMotion pair) {
        steps.fields[pair.fixed_frame] = pair.field;
        steps.lengths_mm[pair.fixed_frame] = step_mm(pair.field, pair.confidence);
        on_pair(std::move(pair));
      },
      on_share);
  if (!estimator) return estimator.error();
  const std::stop_callback on_stop(stop, [&] { (*estimator)->cancel(); });

  // The estimator works on one pair while the next frame is read.
  Status pushed = Nothing{};
  uint64_t first = 0, before = 0;  // fingerprints
  for (size_t k = 0; k < frames && pushed && !stop.stop_requested(); ++k) {
    auto frame = read(k);
    pushed = frame ? (*estimator)->push(k, *frame) : Status(frame.error());
    if (!frame) break;
    const uint64_t now = fingerprint(frame->values);
    if (k > 0 && now == before) notes.push_back(equal_frames(k - 1, k));
    steps.repeats_first = k > 1 && k + 1 == frames && now == first;
    if (k == 0) first = now;
    before = now;
  }

  // A frame that was refused ends the work with its own error, unless a stop came first.
  if (!pushed) (*estimator)->cancel();
  const Status finished = (*estimator)->finish();
  if (!pushed && pushed.error().kind != ErrorKind::kCancelled) return pushed.error();
  if (!finished) return finished.error();
  return steps;
}

/// Whether the last step leads back to the first frame. If not it is left out, and a note says so.
bool closes(ConsecutiveFields& steps, std::vector<std::string>& notes) {
  if (is_closed(steps.lengths_mm, kLargestClosingStep)) return true;
  steps.fields.pop_back();
  char text[300];
  std::snprintf(text, sizeof(text),
                "The last frame does not lead back to the first (%.2g mm on average, other "
                "steps %.2g mm at most): the sequence is not taken for a cycle.",
                steps.lengths_mm.back(),
                *std::max_element(steps.lengths_mm.begin(), steps.lengths_mm.end() - 1));
  notes.emplace_back(text);
  return false;
}

/// Sweeps in which each field becomes the mean of itself and of what its neighbours say by one step
/// more.
std::vector<Field> consensus(std::vector<Field> direct, std::span<const Field> consecutive,
                             std::span<const Confidence> confidence, int sweeps) {
  std::vector<Field> backward;
  for (const Field& field : consecutive) backward.push_back(inverse_of(field, field.grid).w);
  for (int sweep = 0; sweep < sweeps; ++sweep)
    direct = with_neighbours(direct, consecutive, backward, confidence);
  return direct;
}

}  // namespace

size_t frame_nearest_the_mean(std::span<const Field> consecutive) {
  const Grid& grid = consecutive.front().grid;
  const size_t frames = consecutive.size() + 1;
  std::vector<std::vector<glm::dvec3>> places(frames, std::vector<glm::dvec3>(grid.count()));
  for_each_sample(grid, 100.0 * double(frames), [&](size_t n, glm::dvec3 x) {
    places[0][n] = x;
    for (size_t k = 0; k + 1 < frames; ++k)
      places[k + 1][n] = places[k][n] + sample_at_lps(consecutive[k], places[k][n]);
  });
  std::vector<double> sums(frames, 0.0);
  for (size_t a = 0; a < frames; ++a)
    for (size_t b = 0; b < a; ++b) {
      double sum = 0.0;
      for (size_t n = 0; n < grid.count(); ++n) sum += glm::distance(places[a][n], places[b][n]);
      sums[a] += sum;
      sums[b] += sum;
    }
  return size_t(std::min_element(sums.begin(), sums.end()) - sums.begin());
}

std::vector<Field> with_neighbours(std::span<const Field> direct,
                                   std::span<const Field> consecutive,
                                   std::span<const Field> backward,
                                   std::span<const Confidence> confidence) {
  const size_t frames = direct.size();
  const bool cyclic = consecutive.size() == frames;
  std::vector<std::vector<float>> weights;
  for (const Confidence& of_frame : confidence) weights.push_back(weights_of(of_frame));
  const auto weight = [&](size_t k, size_t n) { return weights.empty() ? 1.0F : weights[k][n]; };
  std::vector<Field> result;
  for (size_t k = 0; k < frames; ++k) {
    Field mean = still_field(direct[k].grid);
    const bool has_before = k > 0 || cyclic, has_after = k + 1 < frames || cyclic;
    const size_t before = (k + frames - 1) % frames, after = (k + 1) % frames;
    for_each_sample(mean.grid, 200.0, [&](size_t n, glm::dvec3 x) {
      const float own = weight(k, n);
      glm::dvec3 sum = double(own) * glm::dvec3(direct[k].u_mm[n]);
      double all = own;
      const auto add = [&](size_t neighbour, const Field& between) {
        const glm::dvec3 u(direct[neighbour].u_mm[n]);
        const double w = weight(neighbour, n);
        sum += w * (u + sample_at_lps(between, x + u));
        all += w;
      };
      if (has_before) add(before, consecutive[before]);
      if (has_after) add(after, backward[k]);
      mean.u_mm[n] = glm::vec3(sum / all);
    });
    result.push_back(std::move(mean));
  }
  return result;
}

std::vector<Field> harmonics_of(std::span<const Field> at_frame, const TimeBasis& basis) {
  const size_t frames = at_frame.size(), terms = basis.terms();
  // Normal equations (B^T B) C = B^T U; the same matrix for all samples, so C = M U with M once.
  std::vector<double> square(terms * terms, 0.0), fit(terms * frames);
  for (size_t k = 0; k < frames; ++k) {
    const TimeWeights weights = basis.at(int(k), 0.0);
    for (size_t r = 0; r < terms; ++r) {
      fit[r * frames + k] = weights.weight[r];
      for (size_t c = 0; c < terms; ++c)
        square[r * terms + c] += double(weights.weight[r]) * double(weights.weight[c]);
    }
  }
  solve_in_place(std::move(square), fit, terms, frames);
  std::vector<Field> result;
  for (size_t r = 0; r < terms; ++r) {
    Field term = still_field(at_frame.front().grid);
    for (size_t k = 0; k < frames; ++k)
      for (size_t n = 0; n < term.u_mm.size(); ++n)
        term.u_mm[n] += float(fit[r * frames + k]) * at_frame[k].u_mm[n];
    result.push_back(std::move(term));
  }
  return result;
}

SequenceMotion told_from_reference(const SequenceMotion& motion) {
  const Grid& grid = motion.terms.front().grid;
  const Field back = inverse_of(motion.at_frame(motion.reference), grid).w;
  SequenceMotion told = motion;
  const double cost = 50.0 * double(motion.terms.size());
  for_each_sample(grid, cost, [&](size_t n, glm::dvec3 x) {
    const glm::dvec3 way(back.u_mm[n]);
    for (size_t m = 0; m < motion.terms.size(); ++m) {
      const bool has_way = m == 0 || motion.basis.harmonics == 0;
      told.terms[m].u_mm[n] =
          glm::vec3(sample_at_lps(motion.terms[m], x + way) + (has_way ? way : glm::dvec3(0.0)));
    }
  });
  return told;
}

Field consecutive_field(const SequenceMotion& motion, size_t k) {
  return consecutive_field(motion, k, motion.terms.front().grid);
}

Field consecutive_field(const SequenceMotion& motion, size_t k, const Grid& onto) {
  const Field here = motion.at_frame(k), next = motion.at_frame((k + 1) % motion.frames());
  Field result = inverse_of(here, onto).w;
  for_each_sample(result.grid, 100.0, [&](size_t n, glm::dvec3 y) {
    const glm::dvec3 x = y + glm::dvec3(result.u_mm[n]);
    result.u_mm[n] = glm::vec3(x + sample_at_lps(next, x) - y);
  });
  return result;
}

Distances drift_of(const SequenceMotion& motion, const Grid& image, const Mask* mask) {
  CyclePoints points(image, mask);
  for (size_t k = 0; k < motion.frames(); ++k) points.follow(consecutive_field(motion, k, image));
  return points.drift();
}

Result<SequenceMotion> motion_of_steps(std::span<const Field> consecutive, const TimeBasis& times,
                                       size_t reference) {
  const size_t frames = times.times_s.size();
  const bool cyclic = times.cycle_s > 0.0;
  if (frames < 2 || consecutive.size() != frames - (cyclic ? 0 : 1) || reference >= frames)
    return Error{ErrorKind::kBadInput, "One motion for " + std::to_string(frames) +
                                           " frames can not be made of " +
                                           std::to_string(consecutive.size()) + " fields"};
  for (const Field& field : consecutive)
    if (field.u_mm.empty())
      return Error{ErrorKind::kBadInput,
                   "One motion for all frames needs the field of every step, but one is missing"};
  SequenceMotion motion;
  motion.reference = reference;
  motion.basis = {times.times_s, times.cycle_s, 0};
  motion.terms.assign(frames, still_field(consecutive.front().grid));
  // Number of frames that are reached forward: in a cycle half of them.
  const size_t after = cyclic ? frames / 2 : frames - 1 - reference;
  const auto go_on = [&](size_t from, size_t to, const Field& step) {
    for_each_sample(step.grid, 100.0, [&](size_t n, glm::dvec3 x) {
      const glm::dvec3 u(motion.terms[from].u_mm[n]);
      motion.terms[to].u_mm[n] = glm::vec3(u + sample_at_lps(step, x + u));
    });
  };
  for (size_t n = 0; n < after; ++n) {
    const size_t from = (reference + n) % frames;
    go_on(from, (from + 1) % frames, consecutive[from]);
  }
  for (size_t n = 0; n + after + 1 < frames; ++n) {
    const size_t from = (reference + frames - n) % frames, to = (from + frames - 1) % frames;
    go_on(from, to, inverse_of(consecutive[to], consecutive[to].grid).w);
  }
  return motion;
}

Result<SequenceMotion> estimate_sequence_motion(const std::shared_ptr<vulkan::Context>& context,
                                                const Grid& grid, std::span<const double> times_s,
                                                const FrameReader& read,
                                                const SequenceMotionOptions& options,
                                                const SequenceEstimator::OnMotion& on_pair,
                                                const OnSequenceProgress& progress,
                                                std::stop_token stop, SequenceReport* report) {
  const size_t frames = times_s.size();
  if (frames < 2) return Error{ErrorKind::kBadInput, "A sequence needs two frames or more"};
  if (options.reference.value_or(0) >= frames)
    return Error{ErrorKind::kBadInput, "The reference is no frame of the sequence"};
  EstimatorOptions of_steps = options.estimator;
  of_steps.motion = on_solved_cells(of_steps.motion);
  SequenceReport met;
  const size_t pairs = frames - (of_steps.cyclic ? 0 : 1) + frames - 1;
  size_t done = 0;
  const auto say_pair = [&](size_t fixed, size_t moving, double share) {
    if (progress)
      progress("frame " + std::to_string(fixed) + " to " + std::to_string(moving),
               (double(done) + share) / double(pairs));
  };

  // The motion from each frame to the next.
  auto steps = consecutive_fields(
      context, grid, frames, read, of_steps, stop,
      [&](PairMotion pair) {
        ++done;
        if (on_pair) on_pair(std::move(pair));
      },
      say_pair, met.notes);
  if (!steps) return steps.error();

  // Is it a cycle, and where does it end?
  const bool cyclic = of_steps.cyclic && (frames == 2 || closes(*steps, met.notes));
  SequenceMotion motion;
  motion.frames_grid = grid;
  motion.basis = basis_of(times_s, cyclic, steps->repeats_first);
  if (motion.basis.repeats_first)
    met.notes.emplace_back(
        "The last frame is the first once more: the cycle lasts from the one to the other.");

  // From the frame nearest the mean to all others, which keeps the largest motion small.
  motion.reference = options.reference
                         ? *options.reference
                         : frame_nearest_the_mean(std::span(steps->fields).first(frames - 1));
  const auto reference = read(motion.reference);
  if (!reference) return reference.error();
  auto from_reference = direct_fields(
      context, grid, frames, motion.reference, read, of_steps, stop, [&] { ++done; },
      [&](size_t k, double share) { say_pair(motion.reference, k, share); });
  if (!from_reference) return from_reference.error();
  met.confidence = std::move(from_reference->confidence);

  // What the steps say of them counts too; equal frames have the same field.
  std::vector<Field>& direct = motion.terms;
  direct =
      consensus(std::move(from_reference->fields), steps->fields, met.confidence, options.sweeps);
  if (cyclic && steps->repeats_first)
    direct.front() = direct.back() = combined({direct.front(), direct.back()}, kHalfOfEach);

  // A cycle is smooth in time: harmonics instead of frames, as many as the frames support.
  if (cyclic) {
    const Status chosen = choose_harmonics(motion, *reference, read, options, met);
    if (!chosen) return chosen.error();
  }
  if (report) *report = std::move(met);
  return told_from_reference(motion);
}

Result<SequenceMotion> estimate_coarse_motion(const std::shared_ptr<vulkan::Context>& context,
                                              const Grid& grid, std::span<const double> times_s,
                                              const FrameReader& read, bool cyclic,
                                              size_t reference, const OnSequenceProgress& progress,
                                              std::stop_token stop) {
  const size_t frames = times_s.size();
  EstimatorOptions options;
  options.motion = coarse_options();
  const MotionPlan plan = plan_motion(grid, options.motion);
  const size_t level = std::min(kCoarseLevel, plan.levels.size() - 1);
  if (frames < 2 || reference >= frames || level == 0)
    return Error{ErrorKind::kBadInput, "The sequence is too small for a coarse motion"};
  glm::ivec3 block(1);
  for (size_t l = 1; l <= level; ++l) block *= plan.levels[l].ratio;
  const Grid coarse = level_grid(plan, level);
  std::vector<Volume> means;
  for (size_t k = 0; k < frames; ++k) {
    const auto frame = read(k);
    if (!frame) return frame.error();
    means.push_back(block_means(*frame, block, coarse));
  }
  const FrameReader read_means = [&](size_t k) -> Result<Volume> { return means[k]; };
  size_t done = 0;
  auto direct = direct_fields(
      context, coarse, frames, reference, read_means, options, stop, [&] { ++done; },
      [&](size_t k, double share) {
        if (progress)
          progress("frame " + std::to_string(reference) + " to " + std::to_string(k),
                   (double(done) + share) / double(frames - 1));
      });
  if (!direct) return direct.error();

  // The steps between the frames, as long as the differences of the fields to them.
  std::vector<double> steps_mm;
  for (size_t k = 0; k < frames; ++k) {
    const size_t next = (k + 1) % frames;
    Field step = direct->fields[next];
    for (size_t n = 0; n < step.u_mm.size(); ++n) step.u_mm[n] -= direct->fields[k].u_mm[n];
    steps_mm.push_back(step_mm(step, direct->confidence[k == reference ? next : k]));
  }
  const bool repeats_first = frames > 2 && means.front().values == means.back().values;
  cyclic = cyclic && (frames == 2 || is_closed(steps_mm, kLargestCoarseClosingStep));
  SequenceMotion motion;
  motion.frames_grid = grid;
  motion.reference = reference;
  motion.basis = basis_of(times_s, cyclic, repeats_first);
  motion.terms = std::move(direct->fields);
  if (cyclic) {
    SequenceReport report;
    report.confidence = std::move(direct->confidence);
    const Status chosen =
        choose_harmonics(motion, means[reference], read_means, SequenceMotionOptions(), report);
    if (!chosen) return chosen.error();
  }
  return told_from_reference(motion);
}

}  // namespace palpate
