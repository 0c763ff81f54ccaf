#include "module/scene/look.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate {
namespace {

constexpr double kMostOpaque = 0.999;
constexpr double kUsualSlope = 0.1;  // of a look's range

Error refused(const Look& look, const std::string& what) {
  return {ErrorKind::kBadInput, "The look \"" + look.name + "\" can not be used: " + what + "."};
}

/// Whether the mask counts the voxel at a place of volume space.
bool counts_at(const Mask& mask, glm::dvec3 at_m) {
  const glm::ivec3 voxel(glm::round(mask.grid.index_from_lps(lps_from_volume(at_m))));
  const glm::ivec3 inside = glm::clamp(voxel, glm::ivec3(0), mask.grid.size - 1);
  return mask.values[mask.grid.offset(inside.x, inside.y, inside.z)] != 0;
}

/// The value that divides sorted places in two kinds whose values differ least from their means
/// (Otsu 1979), in a histogram from `low` to `high`.
template <class Place>
double otsu_threshold(double low, double high, const std::vector<Place>& places) {
  constexpr int kBins = 256;
  if (!(high > low)) return low;
  std::array<double, kBins> count{};
  for (const Place& place : places) {
    const double share = (std::clamp(place.value, low, high) - low) / (high - low);
    count[size_t(std::min(share * kBins, kBins - 1.0))] += 1.0;
  }
  double all = 0.0, all_sum = 0.0;
  for (int b = 0; b < kBins; ++b) all += count[size_t(b)], all_sum += b * count[size_t(b)];
  double below = 0.0, below_sum = 0.0, best = -1.0;
  int at = 0;
  for (int b = 0; b + 1 < kBins; ++b) {
    below += count[size_t(b)];
    below_sum += b * count[size_t(b)];
    if (below == 0.0 || below == all) continue;
    const double apart = below_sum / below - (all_sum - below_sum) / (all - below);
    const double between = below * (all - below) * apart * apart;
    if (between > best) best = between, at = b;
  }
  return low + (high - low) * (at + 1) / kBins;
}

Look ct_bone() {
  Look look{"CT bone", {}, {0.30, 0.80, 0.22}, 0.0};
  look.points = {{-1000, {0.55, 0.20, 0.12}, 0.0}, {130, {0.62, 0.22, 0.14}, 0.0},
                 {220, {0.86, 0.52, 0.36}, 0.06},  {350, {0.95, 0.82, 0.66}, 0.45},
                 {700, {0.98, 0.93, 0.84}, 0.85},  {1500, {1.0, 0.98, 0.95}, 0.97}};
  look.surface_slope = 60.0;
  return look;
}

Look ct_heart() {
  Look look{"CT heart", {}, {0.32, 0.78, 0.20}, 0.0};
  // Contrast medium in the chambers is 150 to 500; muscle around 80 is a veil.
  look.points = {{-1000, {0.5, 0.15, 0.1}, 0.0},  {20, {0.70, 0.26, 0.20}, 0.0},
                 {90, {0.72, 0.25, 0.19}, 0.012}, {150, {0.80, 0.30, 0.20}, 0.06},
                 {230, {0.88, 0.40, 0.24}, 0.45}, {400, {0.95, 0.70, 0.48}, 0.85},
                 {900, {1.0, 0.95, 0.88}, 0.97}};
  look.surface_slope = 40.0;
  return look;
}

Look ct_lung() {
  Look look{"CT lung", {}, {0.40, 0.70, 0.12}, 0.0};
  // Air in lungs and vessels are seen; soft tissue around them hardly is.
  look.points = {{-1024, {0.2, 0.3, 0.5}, 0.0},     {-930, {0.25, 0.36, 0.55}, 0.0},
                 {-860, {0.45, 0.62, 0.85}, 0.008}, {-760, {0.62, 0.78, 0.95}, 0.010},
                 {-640, {0.95, 0.70, 0.58}, 0.015}, {-520, {0.95, 0.55, 0.45}, 0.030},
                 {-420, {0.86, 0.42, 0.34}, 0.004}, {-100, {0.80, 0.34, 0.26}, 0.001},
                 {160, {0.80, 0.42, 0.32}, 0.002},  {300, {0.95, 0.85, 0.70}, 0.25},
                 {1200, {1.0, 0.97, 0.92}, 0.90}};
  look.surface_slope = 60.0;
  return look;
}

Look mr() {
  Look look{"MR", {}, {0.38, 0.72, 0.14}, 0.0};
  look.points = {{0.0, {0.05, 0.06, 0.10}, 0.0},    {150.0, {0.25, 0.24, 0.30}, 0.0},
                 {300.0, {0.55, 0.45, 0.42}, 0.06}, {550.0, {0.85, 0.66, 0.52}, 0.25},
                 {800.0, {0.95, 0.86, 0.72}, 0.55}, {1000.0, {1.0, 0.98, 0.95}, 0.85}};
  return look;
}

Look phantom() {
  // Lung is 100, blood 350, wall 1000; the hand's surface lies at 625.
  Look look{"phantom", {}, {0.34, 0.78, 0.24}, 0.0};
  look.points = {{0, {0.30, 0.02, 0.02}, 0.0},
                 {550, {0.55, 0.10, 0.09}, 0.0},
                 {625, {0.78, 0.22, 0.17}, 0.50},
                 {720, {0.86, 0.33, 0.25}, 0.93},
                 {1000, {0.92, 0.45, 0.34}, 0.97}};
  look.surface_slope = 120.0;
  return look;
}

Look heart() {
  // The tissues of the heart phantom, whose values rise from muscle (540) over atria (720), fat
  // (900) and arteries (1100) to veins (1300). The edge of each passes through all lower ones, so
  // these are not quite opaque, and nearly clear between them: only a thin film of them shines
  // through.
  Look look{"heart", {}, {0.38, 0.72, 0.26}, 0.0};
  look.points = {{300, {0.86, 0.45, 0.36}, 0.0},    {420, {0.80, 0.36, 0.28}, 0.08},
                 {480, {0.62, 0.17, 0.14}, 0.72},   {600, {0.56, 0.13, 0.11}, 0.80},
                 {630, {0.70, 0.27, 0.24}, 0.05},   {680, {0.78, 0.36, 0.32}, 0.70},
                 {760, {0.78, 0.36, 0.32}, 0.70},   {790, {0.98, 0.76, 0.30}, 0.05},
                 {860, {1.00, 0.84, 0.32}, 0.50},   {940, {1.00, 0.84, 0.32}, 0.50},
                 {980, {0.88, 0.18, 0.14}, 0.05},   {1060, {0.92, 0.14, 0.10}, 0.93},
                 {1135, {0.92, 0.14, 0.10}, 0.93},  {1160, {0.12, 0.24, 0.90}, 0.30},
                 {1210, {0.10, 0.22, 0.95}, 0.998}, {1350, {0.10, 0.22, 0.95}, 0.998}};
  look.surface_slope = 120.0;
  return look;
}

Look molecule() {
  // Electropotential in V: negative around chlorine, positive around hydrogen.
  Look look{"molecule", {}, {0.45, 0.65, 0.25}, 0.0};
  look.points = {{-2.4, {0.10, 0.25, 0.95}, 0.50},  {-1.2, {0.20, 0.45, 0.95}, 0.05},
                 {-0.5, {0.45, 0.70, 0.98}, 0.004}, {-0.3, {0.45, 0.70, 0.98}, 0.0},
                 {0.3, {0.98, 0.70, 0.45}, 0.0},    {0.5, {0.98, 0.70, 0.45}, 0.004},
                 {1.2, {0.96, 0.42, 0.20}, 0.05},   {2.4, {0.95, 0.18, 0.10}, 0.50}};
  return look;
}

Look flow() {
  // Lengths of vectors, from 0 to 1 until a window says otherwise: a mist in the colours of the
  // tubes, through which these are seen.
  Look look{"flow", {}, {0.60, 0.50, 0.05}, 0.0};
  look.points = {{0.0, {0.25, 0.45, 0.95}, 0.0},
                 {0.6, {0.90, 0.90, 0.95}, 0.0},
                 {1.0, {0.95, 0.40, 0.25}, 0.010}};
  return look;
}

}  // namespace

double linear_from_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

Status check(const Look& look) {
  const auto share = [](double v, double most) { return v >= 0.0 && v <= most; };
  for (size_t k = 0; k < look.points.size(); ++k) {
    const LookPoint& p = look.points[k];
    const std::string which = "point " + std::to_string(k);
    if (!std::isfinite(p.value)) return refused(look, which + " has no finite value");
    if (k > 0 && p.value < look.points[k - 1].value)
      return refused(look, which + " lies below the one before; sort the points by value");
    for (int c = 0; c < 3; ++c)
      if (!share(p.colour[c], 1.0)) return refused(look, which + " has a colour outside 0 to 1");
    if (!share(p.opacity, kMostOpaque))
      return refused(look, which + " has an opacity outside 0 to 0.999");
  }
  for (const double s : {look.shine.ambient, look.shine.diffuse, look.shine.specular})
    if (!share(s, 4.0)) return refused(look, "a share of its shine is outside 0 to 4");
  if (!(look.surface_slope >= 0.0) || !std::isfinite(look.surface_slope))
    return refused(look, "its surface slope is negative or not finite");
  if (!(look.thickness_mm > 0.0) || !std::isfinite(look.thickness_mm))
    return refused(look, "the thickness of its opacities is not above 0 or not finite");
  return Nothing{};
}

LookSample look_at(const Look& look, double value) {
  if (look.points.empty() || std::isnan(value)) return {};
  const auto above =
      std::upper_bound(look.points.begin(), look.points.end(), value,
                       [](double v, const LookPoint& point) { return v < point.value; });
  LookPoint here;
  if (above == look.points.begin()) {
    here = *above;
  } else if (above == look.points.end()) {
    here = look.points.back();
  } else {
    const LookPoint &a = *(above - 1), &b = *above;
    const double share = (value - a.value) / (b.value - a.value);
    here.colour = a.colour + share * (b.colour - a.colour);
    here.opacity = a.opacity + share * (b.opacity - a.opacity);
  }
  LookSample sample;
  for (int c = 0; c < 3; ++c) sample.colour[c] = linear_from_srgb(here.colour[c]);
  sample.extinction_per_mm = -std::log1p(-std::min(here.opacity, kMostOpaque)) / look.thickness_mm;
  return sample;
}

double level_of(const Look& look) {
  return look.points.empty() ? 0.0 : 0.5 * (look.points.front().value + look.points.back().value);
}

double width_of(const Look& look) {
  return look.points.empty() ? 0.0 : look.points.back().value - look.points.front().value;
}

Look windowed(Look look, double level, double width) {
  const double old_level = level_of(look), old_width = width_of(look);
  if (!(width > 0.0) || !(old_width > 0.0)) return look;
  for (LookPoint& point : look.points)
    point.value = level + (point.value - old_level) * (width / old_width);
  look.surface_slope *= width / old_width;
  return look;
}

Look over_range(Look look, double lowest, double highest, double thickness_mm) {
  for (LookPoint& point : look.points) point.value = lowest + point.value * (highest - lowest);
  // The opacities stay those of `thickness_mm`: converted to 1 mm they might exceed the range of an
  // opacity.
  look.thickness_mm = thickness_mm;
  const double share_per_thickness = look.surface_slope > 0.0 ? look.surface_slope : kUsualSlope;
  look.surface_slope = share_per_thickness * (highest - lowest) / thickness_mm;
  return look;
}

std::vector<std::string> preset_names() {
  return {"CT bone", "CT heart", "CT lung", "MR", "phantom", "molecule", "flow", "heart"};
}

Result<Look> preset_look(std::string_view name) {
  for (Look (*make)() : {ct_bone, ct_heart, ct_lung, mr, phantom, molecule, flow, heart}) {
    Look look = make();
    if (look.name == name) return look;
  }
  std::string known;
  for (const std::string& offered : preset_names()) known += (known.empty() ? "" : ", ") + offered;
  return Error{ErrorKind::kBadInput,
               "There is no look called \"" + std::string(name) + "\"; there are " + known + "."};
}

ValueSummary summary_of(const FrameData& frame, const Mask* no_data) {
  constexpr int kAlong = 40;
  struct Place {
    double value, slope_per_mm;
  };
  const glm::dvec3 low = frame.low_m(), high = frame.high_m();
  std::vector<Place> places;
  for (int z = 0; z < kAlong; ++z)
    for (int y = 0; y < kAlong; ++y)
      for (int x = 0; x < kAlong; ++x) {
        const glm::dvec3 at = glm::mix(low, high, (glm::dvec3(x, y, z) + 0.5) / double(kAlong));
        if (no_data && counts_at(*no_data, at)) continue;
        const ScalarSample here = frame.scalar_and_gradient(at);
        if (std::isfinite(here.value))
          places.push_back({here.value, 1e-3 * glm::length(here.gradient)});
      }
  ValueSummary found;
  found.size_mm = 1e3 * glm::distance(low, high);
  if (places.empty()) return found;
  std::sort(places.begin(), places.end(),
            [](const Place& a, const Place& b) { return a.value < b.value; });
  const auto value_at = [&](double share) {
    return places[size_t(share * double(places.size() - 1))].value;
  };
  found.lowest = places.front().value;
  found.highest = places.back().value;
  found.background = otsu_threshold(value_at(0.005), value_at(0.98), places);
  const auto above = std::partition_point(places.begin(), places.end(), [&](const Place& place) {
    return place.value <= found.background;
  });
  const size_t first = size_t(above - places.begin()), count = places.size() - first;
  constexpr std::array<double, 4> kShares{0.25, 0.6, 0.9, 0.99};
  for (size_t q = 0; q < kShares.size(); ++q)
    found.foreground[q] =
        count ? places[first + size_t(kShares[q] * double(count - 1))].value : found.highest;
  std::vector<double> slopes;
  for (size_t n = first; n < places.size(); ++n) slopes.push_back(places[n].slope_per_mm);
  if (!slopes.empty()) {
    const auto steep = slopes.begin() + long(0.9 * double(slopes.size() - 1));
    std::nth_element(slopes.begin(), steep, slopes.end());
    found.surface_slope = *steep;
  }
  return found;
}

Look fitting_look(const ValueSummary& values) {
  if (values.lowest < -300.0) return values.highest > 600.0 ? ct_bone() : ct_lung();
  // By rank: the faint body of a PET is seen as well as its bright bladder.
  Look look{"borders", {}, {0.36, 0.74, 0.22}, 0.0};
  const std::array<double, 4>& q = values.foreground;
  look.points = {{values.background, {0.35, 0.14, 0.12}, 0.0},
                 {q[0], {0.50, 0.20, 0.16}, 0.06},
                 {q[1], {0.72, 0.38, 0.30}, 0.22},
                 {q[2], {0.90, 0.68, 0.54}, 0.50},
                 {q[3], {1.0, 0.95, 0.88}, 0.90}};
  look.surface_slope = values.surface_slope;
  look.thickness_mm = std::max(values.size_mm / 150.0, 1e-9);
  look.flat_opacity = 0.06;
  return look;
}

}  // namespace palpate
