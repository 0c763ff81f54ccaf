#include "module/session/segment_sizes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "compute/volume/portable.h"
#include "module/session/moved_volume.h"

namespace palpate {
namespace {

constexpr double kSizeSamples = 3e5;
constexpr int kBlock = 4;               // samples along an edge that are skipped together
constexpr double kFarAway = 1.5;        // half diagonals of a block: motion may shorten distances
constexpr double kEnclosedShare = 0.5;  // of the cavity's border
constexpr double kAligned = 0.7;        // cosine of the angle between both surfaces
constexpr double kReached_mm = 0.02;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Visits the samples that are inside of a segment or beside it: visit(y, distances_mm), y in
/// volume space, m.
template <class Visit>
void visit_segments(const MovingVolume& volume, MovedReader& reader, double edge_m,
                    std::stop_token stop, const Visit& visit) {
  const FrameData& frame = *volume.frames.front();
  const glm::ivec3 count(glm::ceil((frame.high_m() - frame.low_m()) / edge_m));
  std::vector<double> distances(volume.segments.size());
  const auto read = [&](glm::dvec3 y) {
    const glm::dvec3 x = reader.material_at(y);
    double nearest = -std::numeric_limits<double>::infinity();
    for (size_t s = 0; s < distances.size(); ++s) {
      distances[s] = reader.distance_mm(volume.segments[s], x);
      nearest = std::fmax(nearest, distances[s]);
    }
    return nearest;
  };
  const double far_mm = 1e3 * kFarAway * 0.5 * std::sqrt(3.0) * kBlock * edge_m;
  const auto place = [&](glm::dvec3 index) { return frame.low_m() + edge_m * (index + 0.5); };
  for (int k = 0; k < count.z && !stop.stop_requested(); k += kBlock)
    for (int j = 0; j < count.y; j += kBlock)
      for (int i = 0; i < count.x; i += kBlock) {
        if (read(place(glm::dvec3(i, j, k) + 0.5 * (kBlock - 1))) < -far_mm) continue;
        for (int n = 0; n < kBlock * kBlock * kBlock; ++n) {
          const glm::ivec3 at = glm::ivec3(i, j, k) +
                                glm::ivec3(n % kBlock, n / kBlock % kBlock, n / kBlock / kBlock);
          if (glm::any(glm::greaterThanEqual(at, count))) continue;
          const glm::dvec3 y = place(at);
          read(y);
          visit(y, distances);
        }
      }
}

/// The segment that encloses another one most, and the other one; -1 where none does.
struct CavityPair {
  int wall = -1, cavity = -1;
};

CavityPair cavity_of(const MovingVolume& volume, MovedReader& reader, double edge_m,
                     std::stop_token stop) {
  const size_t n = volume.segments.size();
  // Of the samples just outside of each segment, those that are inside of each other one.
  std::vector<size_t> beside(n, 0), inside(n * n, 0);
  const double edge_mm = 1e3 * edge_m;
  visit_segments(volume, reader, edge_m, stop, [&](glm::dvec3, const std::vector<double>& d) {
    for (size_t c = 0; c < n; ++c) {
      if (!(d[c] < 0.0 && d[c] > -edge_mm)) continue;
      ++beside[c];
      for (size_t w = 0; w < n; ++w) inside[c * n + w] += w != c && d[w] > 0.0;
    }
  });
  CavityPair found;
  double most = kEnclosedShare;
  for (size_t c = 0; c < n; ++c)
    for (size_t w = 0; w < n; ++w)
      if (beside[c] > 0 && double(inside[c * n + w]) / double(beside[c]) > most) {
        most = double(inside[c * n + w]) / double(beside[c]);
        found = {int(w), int(c)};
      }
  return found;
}

/// Adds the share of each segment in a sample. Where segments overlap the one whose surface is
/// nearest has it: the innermost.
void add_shares(const std::vector<double>& distances_mm, double edge_mm, std::vector<size_t>& order,
                std::vector<double>& sums) {
  order.clear();
  for (size_t s = 0; s < distances_mm.size(); ++s)
    if (distances_mm[s] > -0.5 * edge_mm) order.push_back(s);
  std::sort(order.begin(), order.end(),
            [&](size_t a, size_t b) { return distances_mm[a] < distances_mm[b]; });
  double left = 1.0;
  for (const size_t s : order) {
    const double share = std::min(left, std::clamp(distances_mm[s] / edge_mm + 0.5, 0.0, 1.0));
    sums[s] += share;
    left -= share;
  }
}

/// Measures a wall at places near its outer surface.
class WallRuler {
 public:
  WallRuler(const MovingVolume& volume, MovedReader& reader, CavityPair pair)
      : volume_(volume), reader_(reader), pair_(pair) {}

  /// From wall to wall through y, mm; not a number where the surfaces are not parallel, or are not
  /// met.
  double thickness_mm(glm::dvec3 y_m, double step_m) {
    glm::dvec3 to_cavity(0.0), inwards(0.0);
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 step(0.0);
      step[a] = step_m;
      const glm::dvec2 slope = distances_mm(y_m + step) - distances_mm(y_m - step);
      to_cavity[a] = slope.x;
      inwards[a] = slope.y;
    }
    const glm::dvec3 way = glm::normalize(to_cavity);
    if (!(glm::dot(way, glm::normalize(inwards)) > kAligned)) return kUnknown;
    return met_mm(y_m, way, 0) + met_mm(y_m, -way, 1);
  }

 private:
  /// To the cavity's surface and to the outer one, mm, above 0 inside.
  glm::dvec2 distances_mm(glm::dvec3 y_m) {
    const glm::dvec3 x = reader_.material_at(y_m);
    const double cavity = reader_.distance_mm(volume_.segments[size_t(pair_.cavity)], x);
    const double wall = reader_.distance_mm(volume_.segments[size_t(pair_.wall)], x);
    return {cavity, std::fmax(cavity, wall)};
  }

  /// How far it is to one of the surfaces: steps as long as the distance that is left, which is the
  /// exact one where nothing is stretched.
  double met_mm(glm::dvec3 y_m, glm::dvec3 way, int surface) {
    constexpr int kMostSteps = 30;
    double gone_mm = 0.0;
    for (int n = 0; n < kMostSteps; ++n) {
      const double signed_mm = distances_mm(y_m + 1e-3 * gone_mm * way)[surface];
      const double left_mm = surface == 0 ? -signed_mm : signed_mm;
      if (!std::isfinite(left_mm)) return kUnknown;
      if (std::abs(left_mm) < kReached_mm) return gone_mm;
      gone_mm += left_mm;
    }
    return kUnknown;
  }

  const MovingVolume& volume_;
  MovedReader& reader_;
  CavityPair pair_;
};

}  // namespace

SegmentSizes segment_sizes(const MovingVolume& volume, std::stop_token stop) {
  SegmentSizes sizes;
  for (const Segment& segment : volume.segments)
    sizes.volumes_ml.push_back({segment.name, segment.colour, {}});
  if (volume.segments.empty()) return sizes;
  const FrameData& frame = *volume.frames.front();
  const glm::dvec3 extent_m = frame.high_m() - frame.low_m();
  const double edge_m = portable::cube_root(extent_m.x * extent_m.y * extent_m.z / kSizeSamples);
  const double edge_mm = 1e3 * edge_m, sample_ml = 1e-3 * edge_mm * edge_mm * edge_mm;
  const std::vector<double>& times_s = volume.times.times_s;
  const size_t known = std::min(volume.segments_frame, times_s.size() - 1);
  MovedReader first(volume, times_s[known]);
  const CavityPair pair = cavity_of(volume, first, edge_m, stop);
  if (pair.wall >= 0) {
    const Segment& wall = volume.segments[size_t(pair.wall)];
    sizes.cavity = pair.cavity;
    sizes.wall_mm = {wall.name, wall.colour, {}};
  }
  std::vector<double> shares;
  std::vector<size_t> order;
  for (const double time_s : times_s) {
    MovedReader reader(volume, time_s);
    WallRuler ruler(volume, reader, pair);
    shares.assign(volume.segments.size(), 0.0);
    double thickness_mm = 0.0;
    size_t measured = 0;
    bool all_known = true;
    visit_segments(volume, reader, edge_m, stop, [&](glm::dvec3 y, const std::vector<double>& d) {
      add_shares(d, edge_mm, order, shares);
      if (pair.wall < 0) return;
      const double outer = std::fmax(d[size_t(pair.wall)], d[size_t(pair.cavity)]);
      if (!(outer > 0.0 && outer < edge_mm)) return;
      // Where the cavity reaches the outer surface there is no wall: a valve, or the cut.
      if (!(d[size_t(pair.cavity)] < -edge_mm)) return;
      const double here = ruler.thickness_mm(y, 0.5 * edge_m);
      if (std::isfinite(here)) thickness_mm += here, ++measured;
    });
    if (stop.stop_requested()) break;
    // A segment of one frame is known nowhere else.
    for (size_t s = 0; s < shares.size(); ++s) {
      const glm::dvec3 middle = 0.5 * (frame.low_m() + frame.high_m());
      const bool is_known = !std::isnan(reader.distance_mm(volume.segments[s], middle));
      all_known &= is_known;
      sizes.volumes_ml[s].values.push_back(is_known ? sample_ml * shares[s] : kUnknown);
    }
    if (pair.wall >= 0)
      sizes.wall_mm.values.push_back(all_known && measured > 0 ? thickness_mm / double(measured)
                                                               : kUnknown);
  }
  return sizes;
}

}  // namespace palpate
