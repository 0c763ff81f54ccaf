#include "compute/volume/heart_phantom.h"

#include <array>
#include <cassert>
#include <cmath>
#include <span>
#include <type_traits>

#include "compute/volume/dual.h"
#include "compute/volume/grid_samples.h"
#include "compute/volume/phantom_texture.h"
#include "compute/volume/portable.h"

namespace palpate {
namespace {

// Lengths in mm. "Body" axes: x to the patient's left, y up, z to the front.

constexpr double kHeartEdgeVoxels = 1.5;

/// A tissue: its value, and how far its texture goes from it.
struct TissueTexture {
  double value, texture, fine_mm, coarse_mm;
  uint32_t seed;
};
constexpr TissueTexture kLungTissue{60.0, 45.0, 5.0, 11.0, 10};
constexpr TissueTexture kVenousBlood{190.0, 35.0, 5.0, 9.0, 20};
constexpr TissueTexture kArterialBlood{210.0, 35.0, 5.0, 9.0, 30};
constexpr TissueTexture kFat{900.0, 40.0, 4.0, 8.0, 40};
constexpr TissueTexture kAtrium{720.0, 40.0, 3.5, 8.0, 50};
constexpr TissueTexture kMuscle{540.0, 55.0, 3.5, 9.0, 60};
constexpr TissueTexture kArtery{1100.0, 30.0, 5.0, 9.0, 70};
constexpr TissueTexture kVein{1300.0, 30.0, 5.0, 9.0, 80};

// --- Vectors of plain or dual numbers
// -------------------------------------------------------------

template <class Point>
using NumberOf = std::remove_cvref_t<decltype(Point::x)>;

template <class Point>
Point from(const Point& p, glm::dvec3 centre) {
  return {p.x - centre.x, p.y - centre.y, p.z - centre.z};
}
template <class Point>
Point moved(const Point& p, const NumberOf<Point>& way, glm::dvec3 direction) {
  return {p.x + way * direction.x, p.y + way * direction.y, p.z + way * direction.z};
}
template <class Point>
NumberOf<Point> along(const Point& p, glm::dvec3 axis) {
  return p.x * axis.x + p.y * axis.y + p.z * axis.z;
}
template <class Point>
NumberOf<Point> squared(const Point& p) {
  return p.x * p.x + p.y * p.y + p.z * p.z;
}
template <class Number>
Number smaller(const Number& a, const Number& b) {
  return dual::value(a) < dual::value(b) ? a : b;
}
template <class Number>
Number larger(const Number& a, const Number& b) {
  return dual::value(a) < dual::value(b) ? b : a;
}
/// The smaller of two distances, rounded where they differ by less than `round`: the union of two
/// bodies with a fillet between them.
template <class Number>
Number joined(const Number& a, const Number& b, double round) {
  const double difference = std::abs(dual::value(a) - dual::value(b));
  if (difference >= round) return smaller(a, b);
  const Number h = round - (dual::value(a) < dual::value(b) ? b - a : a - b);
  return smaller(a, b) - h * h * (0.25 / round);
}

// --- Where the heart lies
// -------------------------------------------------------------------------

/// Orthonormal and right-handed: z along `up`, x as near to `aside` as that leaves it.
glm::dmat3 axes_of(glm::dvec3 up, glm::dvec3 aside) {
  const glm::dvec3 z = glm::normalize(up);
  const glm::dvec3 x = glm::normalize(aside - glm::dot(aside, z) * z);
  return {x, glm::cross(z, x), z};
}
/// z from the apex to the base of the left ventricle, x towards the right ventricle.
const glm::dmat3 kAxes = axes_of({-0.62, 0.60, -0.50}, {-0.45, 0.05, 0.89});
/// Of the right ventricle: towards the apex it leans on the left one.
const glm::dmat3 kRightAxes = axes_of(kAxes[2] + 0.30 * kAxes[0], kAxes[0]);
const glm::dmat3 kBodyAxes(1.0);
constexpr glm::dvec3 kLeftCentre{15.0, -14.0, -6.0};  // of the left ventricle
const glm::dvec3 kRightCentre = kLeftCentre + kAxes * glm::dvec3(19.0, 0.0, 4.0);
constexpr glm::dvec3 kBodyShift{0.0, 2.0, -6.0};  // puts the heart into the middle of the cube

template <class Point>
Point body_from_lps(const Point& p) {
  return {p.x + kBodyShift.x, p.z + kBodyShift.y, kBodyShift.z - p.y};
}
glm::dvec3 lps_from_body(glm::dvec3 b) {
  return {b.x - kBodyShift.x, kBodyShift.z - b.z, b.y - kBodyShift.y};
}

// --- Motion: from a frame to the material (where it is in frame 0)
// --------------------------------

/// 3 u^2 - 2 u^3, 0 before and 1 after.
double eased(double u) {
  const double t = std::clamp(u, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

struct Phase {
  double ventricles = 0.0;  ///< contraction, 0 to 1
  double atria = 0.0;       ///< contraction; below 0: filled
};

Phase phase_of(int frame, int frames) {
  constexpr double kContracted = 0.40, kRelaxed = 0.90, kKickStart = 0.70;
  const double at = double(((frame % frames) + frames) % frames) / frames;
  Phase phase;
  phase.ventricles = at < kContracted ? eased(at / kContracted)
                                      : 1.0 - eased((at - kContracted) / (kRelaxed - kContracted));
  const double u = std::clamp((at - kKickStart) / (1.0 - kKickStart), 0.0, 1.0);
  phase.atria = 16.0 * u * u * (1.0 - u) * (1.0 - u) - 0.8 * phase.ventricles;
  return phase;
}

/// x with f(x) = wanted between low and high, to rounding; f rises from below `wanted` to above it.
/// f gives value and slope. Newton's steps, halving where one would leave the bracket.
template <class Function>
double solved(const Function& f, double wanted, double low, double high) {
  double x = 0.5 * (low + high);
  for (int step = 0; step < 100; ++step) {
    const auto [value, slope] = f(x);
    const double miss = value - wanted;
    if (std::abs(miss) < 1e-12) break;
    (miss > 0.0 ? high : low) = x;
    const double next = x - miss / slope;
    x = next > low && next < high ? next : 0.5 * (low + high);
  }
  return x;
}

/// Material lies farther from a chamber's axis than in the frame, by the factor 1 + a q^3, q = 1 -
/// (r / radius)^2 - (z / half)^4 and 1 beyond q = 0. Along the radius its slope is 1 + a q^2 (q - 6
/// (r / radius)^2), at least 1 - 0.653 a for a > 0 and 1 + a for a < 0.
struct Squeeze {
  glm::dvec3 centre, axis;
  double radius, half, amount;

  double factor_slope(double q, double t2, double a) const {
    return 1.0 + a * q * q * (q - 6.0 * t2);
  }
  template <class Point>
  Point material(const Point& p, double phase) const {
    using Number = NumberOf<Point>;
    const Point v = from(p, centre);
    const Number z = along(v, axis), u = z * z * (1.0 / (half * half));
    const Number q = 1.0 - u * u - (squared(v) - z * z) * (1.0 / (radius * radius));
    if (!(dual::value(q) > 0.0)) return p;
    const Number f = (phase * amount) * (q * q * q);
    return {p.x + f * (v.x - z * axis.x), p.y + f * (v.y - z * axis.y),
            p.z + f * (v.z - z * axis.z)};
  }
  glm::dvec3 frame(glm::dvec3 material_mm, double phase) const {
    const glm::dvec3 v = material_mm - centre;
    const double z = glm::dot(v, axis), u = z * z / (half * half), along_axis = 1.0 - u * u;
    const glm::dvec3 across = v - z * axis;
    const double wanted = glm::length(across), a = phase * amount;
    if (!(along_axis > 0.0) || !(wanted > 0.0)) return material_mm;
    const auto f = [&](double r) {
      const double t2 = r * r / (radius * radius), q = std::max(0.0, along_axis - t2);
      return std::pair(r * (1.0 + a * q * q * q), factor_slope(q, t2, a));
    };
    const double r = solved(f, wanted, wanted / (1.0 + std::max(a, 0.0)) - 1e-9,
                            wanted / (1.0 + std::min(a, 0.0)) + 1e-9);
    return material_mm + (r / wanted - 1.0) * across;
  }
};

const Squeeze kLeftVentricle{kLeftCentre, kAxes[2], 36.0, 48.0, 0.67};
const Squeeze kRightVentricle{kLeftCentre + kAxes * glm::dvec3(33.0, 0.0, 4.0), kAxes[2], 32.0,
                              44.0, 0.60};
constexpr Squeeze kRightAtrium{{-27.0, 4.0, -4.0}, {0.0, 1.0, 0.0}, 28.0, 34.0, 0.30};
constexpr Squeeze kLeftAtrium{{2.0, 12.0, -33.0}, {1.0, 0.0, 0.0}, 26.0, 38.0, 0.30};

/// The base comes towards the apex: material lies `kDescent` q^3 farther along the long axis, q = 1
/// - ((z - kBase) / kBaseHalf)^2 - (r / kBaseRadius)^2. Its slope along the axis is within 1 +-
/// 0.378.
constexpr double kDescent = 11.0, kBase = 17.0, kBaseHalf = 50.0, kBaseRadius = 50.0;
const glm::dvec3 kBaseCentre = kLeftCentre + kAxes * glm::dvec3(12.0, 0.0, 0.0);

template <class Point>
Point base_material(const Point& p, double phase) {
  using Number = NumberOf<Point>;
  const Point v = from(p, kBaseCentre);
  const Number z = along(v, kAxes[2]), t = (z - kBase) * (1.0 / kBaseHalf);
  const Number q = 1.0 - t * t - (squared(v) - z * z) * (1.0 / (kBaseRadius * kBaseRadius));
  if (!(dual::value(q) > 0.0)) return p;
  return moved(p, Number((phase * kDescent) * (q * q * q)), kAxes[2]);
}

glm::dvec3 base_frame(glm::dvec3 material_mm, double phase) {
  const glm::dvec3 v = material_mm - kBaseCentre;
  const double wanted = glm::dot(v, kAxes[2]);
  const double across = 1.0 - (glm::dot(v, v) - wanted * wanted) / (kBaseRadius * kBaseRadius);
  if (!(across > 0.0)) return material_mm;
  const auto f = [&](double z) {
    const double t = (z - kBase) / kBaseHalf, q = std::max(0.0, across - t * t);
    const double way = phase * kDescent;
    return std::pair(z + way * q * q * q, 1.0 - way * 6.0 * q * q * t / kBaseHalf);
  };
  const double z = solved(f, wanted, wanted - phase * kDescent - 1e-9, wanted + 1e-9);
  return material_mm + (z - wanted) * kAxes[2];
}

/// A rotation about the long axis by an angle that depends on height and radius alone, the other
/// way at the apex than at the base. way: 1 to the material, -1 back.
constexpr double kTwist = 0.18, kTwistZero = 12.0, kTwistHalf = 48.0, kTwistRadius = 40.0;

template <class Point>
Point twisted(const Point& p, double phase, double way) {
  using Number = NumberOf<Point>;
  const Point v = from(p, kLeftCentre);
  const Number z = along(v, kAxes[2]);
  const Number u = z * z * (1.0 / (kTwistHalf * kTwistHalf));
  const Number q = 1.0 - u * u - (squared(v) - z * z) * (1.0 / (kTwistRadius * kTwistRadius));
  if (!(dual::value(q) > 0.0)) return p;
  // Tangent of half the angle: sine and cosine follow without a table.
  const Number t = (way * phase * kTwist / 40.0) * ((z - kTwistZero) * (q * q));
  const Number divisor = 1.0 / (1.0 + t * t);
  const Number cosine_less_1 = -2.0 * t * t * divisor, sine = 2.0 * t * divisor;
  const Number x = along(v, kAxes[0]), y = along(v, kAxes[1]);
  const Point turned = moved(p, Number(x * cosine_less_1 - y * sine), kAxes[0]);
  return moved(turned, Number(x * sine + y * cosine_less_1), kAxes[1]);
}

template <class Point>
Point material_of(Point p, const Phase& phase) {
  if (phase.ventricles != 0.0) {
    p = base_material(p, phase.ventricles);
    p = twisted(p, phase.ventricles, 1.0);
    p = kLeftVentricle.material(p, phase.ventricles);
    p = kRightVentricle.material(p, phase.ventricles);
  }
  if (phase.atria != 0.0) {
    p = kRightAtrium.material(p, phase.atria);
    p = kLeftAtrium.material(p, phase.atria);
  }
  return p;
}

glm::dvec3 frame_of(glm::dvec3 p, const Phase& phase) {
  if (phase.atria != 0.0) {
    p = kLeftAtrium.frame(p, phase.atria);
    p = kRightAtrium.frame(p, phase.atria);
  }
  if (phase.ventricles != 0.0) {
    p = kRightVentricle.frame(p, phase.ventricles);
    p = kLeftVentricle.frame(p, phase.ventricles);
    p = twisted(p, phase.ventricles, -1.0);
    p = base_frame(p, phase.ventricles);
  }
  return p;
}

// --- Shapes: distances to surfaces, below 0 inside
// ------------------------------------------------

/// Farther away than this a distance need not be more than a lower bound: no fillet reaches it.
constexpr double kFar = 24.0;

struct Ellipsoid {
  glm::dvec3 centre, half;  ///< half: along the axes
  const glm::dmat3& axes;

  /// To first order: exact on the axes and at the surface.
  template <class Point>
  NumberOf<Point> distance(const Point& p) const {
    using Number = NumberOf<Point>;
    const Point v = from(p, centre);
    const double reach = std::max({half.x, half.y, half.z}) + kFar;
    const double away2 = dual::value(squared(v));
    if (away2 > reach * reach) return std::sqrt(away2) - reach + kFar;
    const Number x = along(v, axes[0]) * (1.0 / half.x), y = along(v, axes[1]) * (1.0 / half.y),
                 z = along(v, axes[2]) * (1.0 / half.z);
    const Number rho = dual::square_root(x * x + y * y + z * z + 1e-12);
    const Number slope2 = x * x * (1.0 / (half.x * half.x)) + y * y * (1.0 / (half.y * half.y)) +
                          z * z * (1.0 / (half.z * half.z)) + 1e-16;
    return (rho - 1.0) * rho / dual::square_root(slope2);
  }
};

/// A point of a tube's axis, and how thick the tube is there.
struct TubeKnot {
  glm::dvec3 at;
  double radius;
};

/// A tube through knots: the union of round cones.
class Tube {
 public:
  Tube(std::initializer_list<TubeKnot> knots) : box_(knots), count_(knots.size() - 1) {
    assert(knots.size() >= 2 && count_ <= cones_.size());
    for (size_t k = 0; k < count_; ++k) cones_[k] = Cone(knots.begin()[k], knots.begin()[k + 1]);
  }

  template <class Point>
  NumberOf<Point> distance(const Point& p) const {
    using Number = NumberOf<Point>;
    constexpr double kRound = 2.0, kRounding = 1e-6;
    const glm::dvec3 v(dual::value(p.x), dual::value(p.y), dual::value(p.z));
    const double bound = box_.distance(v);
    if (bound > kFar) return bound;
    Number nearest = 1e9;
    for (size_t k = 0; k < count_; ++k) {
      // A cone that is too far away for a fillet changes nothing.
      if (cones_[k].box.distance(v) - kRounding > dual::value(nearest) + kRound) continue;
      nearest = joined(nearest, cones_[k].distance(p), kRound);
    }
    return nearest;
  }

 private:
  /// What contains the balls around knots: no point of their tube is nearer than it.
  struct Box {
    Box() = default;
    explicit Box(std::initializer_list<TubeKnot> knots) {
      glm::dvec3 low(1e300), high(-1e300);
      for (const TubeKnot& k : knots)
        low = glm::min(low, k.at - k.radius), high = glm::max(high, k.at + k.radius);
      middle = 0.5 * (low + high);
      half = 0.5 * (high - low);
    }
    double distance(glm::dvec3 v) const {
      const glm::dvec3 out = glm::abs(v - middle) - half;
      return std::max({out.x, out.y, out.z});
    }
    glm::dvec3 middle{0.0}, half{0.0};
  };
  struct Cone {
    Cone() = default;
    Cone(const TubeKnot& from, const TubeKnot& to)
        : box({from, to}),
          at(from.at),
          way(to.at - from.at),
          per_length2(1.0 / glm::dot(way, way)),
          radius(from.radius),
          wider(to.radius - from.radius) {}
    template <class Point>
    NumberOf<Point> distance(const Point& p) const {
      using Number = NumberOf<Point>;
      const Point v = from(p, at);
      const Number t = along(v, way) * per_length2;
      const Number on = larger(smaller(t, Number(1.0)), Number(0.0));
      const Number away2 = squared(moved(v, Number(-1.0 * on), way));
      return dual::square_root(away2 + 1e-12) - radius - on * wider;
    }
    Box box;
    glm::dvec3 at{0.0}, way{0.0};
    double per_length2 = 0.0, radius = 0.0, wider = 0.0;
  };

  Box box_;
  std::array<Cone, 9> cones_;
  size_t count_;
};

const Ellipsoid kLeft{kLeftCentre, {26.5, 26.5, 42.0}, kAxes};
const Ellipsoid kRight{kRightCentre, {23.0, 32.0, 39.0}, kRightAxes};
const Ellipsoid kRightAtriumBody{{-27.0, 4.0, -4.0}, {17.0, 23.0, 18.0}, kBodyAxes};
const Ellipsoid kRightAppendage{{-15.0, 19.0, 10.0}, {13.0, 8.5, 9.0}, kBodyAxes};
const Ellipsoid kLeftAtriumBody{{2.0, 12.0, -33.0}, {25.0, 18.0, 15.0}, kBodyAxes};
const Ellipsoid kLeftAppendage{{26.0, 15.0, -10.0}, {9.0, 9.0, 15.0}, kBodyAxes};

const Tube kAorta{{{-3, 10, -7}, 13},   {{-7, 22, -3}, 12.5},    {{-10, 32, -1}, 11.5},
                  {{-8, 41, -4}, 11},   {{-1, 46.5, -11}, 10.5}, {{7, 46, -20}, 10},
                  {{13, 39, -29}, 9.5}, {{17, 27, -39}, 9},      {{19, 10, -47}, 9},
                  {{18, -90, -50}, 9}};
const Tube kArchBranches[] = {{{{-8, 44, -5}, 6}, {{-11, 58, -4}, 5}, {{-18, 80, 0}, 4.5}},
                              {{{-1, 48, -12}, 5}, {{0, 62, -11}, 4}, {{3, 80, -9}, 3.8}},
                              {{{6, 48, -19}, 5}, {{10, 62, -20}, 4.2}, {{16, 80, -18}, 4}}};
/// The transition from the right ventricle to the pulmonary trunk.
const Tube kConus{{{2, 2, 14}, 16}, {{6, 12, 17}, 14.5}, {{8, 20, 15}, 13}};
const Tube kTrunk{{{6, 13, 15}, 10},   {{8, 20, 14}, 12},  {{9, 28, 10}, 12.3},
                  {{11, 36, 1}, 11.5}, {{14, 40, -8}, 10}, {{28, 41, -19}, 8.5},
                  {{70, 40, -28}, 8}};
const Tube kRightPulmonary{
    {{10, 38, -6}, 9}, {{-10, 33, -15}, 8.5}, {{-36, 32, -19}, 8}, {{-80, 30, -22}, 7.5}};
const Tube kUpperCava{{{-27, 20, -7}, 9}, {{-29, 40, -9}, 8.5}, {{-31, 90, -8}, 8.5}};
const Tube kLowerCava{{{-23, -8, -10}, 10}, {{-22, -30, -17}, 10}, {{-22, -90, -20}, 10}};
const Tube kPulmonaryVeins[] = {{{{16, 17, -36}, 7}, {{30, 22, -39}, 6}, {{80, 34, -44}, 6}},
                                {{{16, 8, -38}, 7}, {{30, 4, -42}, 6}, {{80, -6, -50}, 6}},
                                {{{-14, 16, -37}, 7}, {{-30, 20, -39}, 6}, {{-80, 32, -42}, 6}},
                                {{{-14, 7, -38}, 7}, {{-30, 2, -42}, 6}, {{-80, -8, -48}, 6}}};
/// Where blood passes from chamber to chamber.
const Tube kMitral{{{7, -6, -13}, 10}, {{1, 9, -30}, 10}};
const Tube kAortic{{{6, -4, -10}, 8}, {{-5, 16, -5}, 10}};
const Tube kTricuspid{{{-22, 2, -2}, 10}, {{-10, -6, 10}, 10}};
const Tube kPulmonic{{{2, -4, 20}, 10}, {{6, 13, 16}, 11}};
const Tube kPapillary[] = {{{{23, -36, -2}, 6}, {{14, -16, -14}, 3.5}},
                           {{{36, -24, -8}, 6}, {{20, -8, -20}, 3.5}}};

/// Vessels end here: in the open, as an anatomist cuts them.
template <class Point>
NumberOf<Point> beyond_cut(const Point& p) {
  using Number = NumberOf<Point>;
  const Number up = larger(Number(p.y - 63.0), Number(-48.0 - p.y));
  return larger(up, larger(Number(p.x - 50.0), Number(-50.0 - p.x)));
}

template <class Point>
auto value_in(const Point& p, const TissueTexture& tissue, uint32_t seed) {
  return NumberOf<Point>(tissue.value + tissue.texture * texture::tissue(seed + tissue.seed, p,
                                                                         tissue.fine_mm,
                                                                         tissue.coarse_mm));
}

/// Paints tissues from the front to the back: what is nearer to the front hides what is behind.
template <class Point>
class Painter {
 public:
  using Number = NumberOf<Point>;
  Painter(const Point& p, double edge_mm, uint32_t seed) : p_(p), edge_mm_(edge_mm), seed_(seed) {}

  /// Tissue where the distance is below 0.
  void paint(const Number& distance, const TissueTexture& tissue) {
    if (hidden() || dual::value(distance) >= 0.5 * edge_mm_) return;
    const Number cover = left_ * texture::soft_step(Number(-1.0 * distance), edge_mm_);
    sum_ = sum_ + cover * value_in(p_, tissue, seed_);
    left_ = left_ - cover;
  }
  /// A wall around blood.
  void paint(const Number& distance, const Number& wall_mm, const TissueTexture& wall,
             const TissueTexture& blood) {
    paint(Number(distance + wall_mm), blood);
    paint(distance, wall);
  }
  bool hidden() const { return !(dual::value(left_) > 1e-12); }
  Number over(const TissueTexture& background) {
    return hidden() ? sum_ : Number(sum_ + left_ * value_in(p_, background, seed_));
  }

 private:
  const Point& p_;
  double edge_mm_;
  uint32_t seed_;
  Number sum_ = 0.0, left_ = 1.0;
};

/// Thickness of the left ventricle's wall: thinner towards the apex, its inside uneven.
template <class Point>
NumberOf<Point> left_wall(const Point& p, uint32_t seed) {
  using Number = NumberOf<Point>;
  const Number z = along(from(p, kLeftCentre), kAxes[2]);
  const Number below = smaller(Number((z + 12.0) * (1.0 / 28.0)), Number(0.0));
  return 11.0 - 5.0 * below * below +
         0.8 * texture::smooth_noise(texture::mixed(seed + 3), p / Number(5.0));
}

/// The value of material, body axes.
template <class Point>
NumberOf<Point> material_value(const Point& p, double edge_mm, uint32_t seed) {
  using Number = NumberOf<Point>;
  Painter<Point> painter(p, edge_mm, seed);
  const Number left = kLeft.distance(p);
  // Deep in the muscle or the blood of the left ventricle no other distance is needed.
  painter.paint(kMitral.distance(p), kArterialBlood);
  painter.paint(kAortic.distance(p), kArterialBlood);
  if (dual::value(left) < 0.0) {
    for (const Tube& papillary : kPapillary) painter.paint(papillary.distance(p), kMuscle);
  }
  if (dual::value(left) < 0.5 * edge_mm)
    painter.paint(left, left_wall(p, seed), kMuscle, kArterialBlood);
  if (painter.hidden()) return painter.over(kLungTissue);

  painter.paint(kTricuspid.distance(p), kVenousBlood);
  painter.paint(kPulmonic.distance(p), kVenousBlood);
  const Number cut = beyond_cut(p);
  Number aorta = kAorta.distance(p);
  for (const Tube& branch : kArchBranches) aorta = joined(aorta, branch.distance(p), 3.0);
  const Number trunk = joined(kTrunk.distance(p), kRightPulmonary.distance(p), 3.0);
  const auto vessel = [&](const Number& distance, double wall_mm, const TissueTexture& wall,
                          const TissueTexture& blood) {
    painter.paint(larger(Number(distance + wall_mm), cut), blood);
    painter.paint(larger(distance, cut), wall);
  };
  vessel(aorta, 2.4, kArtery, kArterialBlood);
  const Number right = joined(kRight.distance(p), kConus.distance(p), 8.0);
  if (dual::value(right) < 0.5 * edge_mm) {
    const Number rough =
        4.5 + 0.9 * texture::smooth_noise(texture::mixed(seed + 4), p / Number(4.0));
    painter.paint(right, rough, kMuscle, kVenousBlood);
  }
  vessel(trunk, 2.2, kVein, kVenousBlood);
  const Number left_atrium = joined(kLeftAtriumBody.distance(p), kLeftAppendage.distance(p), 4.0);
  painter.paint(left_atrium, Number(2.8), kAtrium, kArterialBlood);
  const Number right_atrium =
      joined(kRightAtriumBody.distance(p), kRightAppendage.distance(p), 4.0);
  painter.paint(right_atrium, Number(2.8), kAtrium, kVenousBlood);
  const Number cava = smaller(kUpperCava.distance(p), kLowerCava.distance(p));
  vessel(cava, 2.2, kVein, kVenousBlood);
  Number veins = 1e9;
  for (const Tube& vein : kPulmonaryVeins) veins = smaller(veins, vein.distance(p));
  vessel(veins, 2.2, kArtery, kArterialBlood);
  if (painter.hidden()) return painter.over(kLungTissue);

  // Coronary arteries lie where two chambers meet, on top of the fat that fills the groove.
  const Number atria = smaller(left_atrium, right_atrium), ventricles = smaller(left, right);
  const auto groove = [](const Number& a, const Number& b, double radius) -> Number {
    constexpr double kDepth = 2.4;
    const Number da = a - kDepth, db = b - kDepth;
    return dual::square_root(da * da + db * db + 1e-6) - radius;
  };
  if (dual::value(ventricles) < 6.0) {
    painter.paint(groove(left, right, 1.7), kArtery);
    painter.paint(groove(atria, ventricles, 1.8), kArtery);
  }
  constexpr double kRound = 10.0;
  Number heart = joined(left, right, kRound);
  heart = joined(heart, atria, kRound);
  heart = joined(heart, smaller(trunk, aorta), kRound);
  constexpr double kThickestFat = 0.8;
  if (dual::value(heart) < 0.5 * edge_mm + kThickestFat) {
    const Number patches =
        1.5 * texture::smooth_noise(texture::mixed(seed + 5), p / Number(13.0)) - 0.7;
    painter.paint(larger(Number(heart - patches), larger(Number(p.y - 34.0), cut)), kFat);
  }
  return painter.over(kLungTissue);
}

glm::dvec3 material_point(glm::dvec3 lps_mm, const Phase& phase) {
  return material_of(body_from_lps(lps_mm), phase);
}

double voxel_of(const Grid& grid) {
  return portable::cube_root(grid.spacing_mm.x * grid.spacing_mm.y * grid.spacing_mm.z);
}

}  // namespace

Sequence heart_phantom(const Grid& grid, int frames, uint32_t seed, double noise) {
  assert(frames > 0);
  Sequence sequence;
  sequence.name = "beating-heart phantom";
  sequence.times_known = true;
  const double edge_mm = kHeartEdgeVoxels * voxel_of(grid);
  const double noise_sd = noise * (kMuscle.value - kLungTissue.value);
  Volume rest{grid, std::vector<float>(grid.count())};
  for_each_sample(grid, 500.0, [&](size_t offset, glm::dvec3 lps_mm) {
    rest.values[offset] = float(material_value(body_from_lps(lps_mm), edge_mm, seed));
  });
  for (int k = 0; k < frames; ++k) {
    const Phase phase = phase_of(k, frames);
    const uint32_t noise_seed = texture::mixed(seed + 1000003U * uint32_t(k + 1));
    Volume frame{grid, std::vector<float>(grid.count())};
    for_each_sample(grid, 400.0, [&](size_t offset, glm::dvec3 lps_mm) {
      const glm::dvec3 body = body_from_lps(lps_mm), material = material_of(body, phase);
      // Most of the volume does not move: it is as in the frame at rest.
      const double value =
          material == body ? double(rest.values[offset]) : material_value(material, edge_mm, seed);
      const double error =
          noise_sd > 0.0 ? noise_sd * texture::gaussian_like(noise_seed, offset) : 0.0;
      frame.values[offset] = float(value + error);
    });
    sequence.frames.push_back(std::move(frame));
    sequence.times_s.push_back(double(k) / frames);
  }
  return sequence;
}

Sequence heart_phantom(int size, int frames, uint32_t seed, double noise) {
  return heart_phantom(heart_grid(size), frames, seed, noise);
}

double heart_value(glm::dvec3 lps_mm, int frame, int frames, uint32_t seed, double voxel_mm) {
  return material_value(material_point(lps_mm, phase_of(frame, frames)),
                        kHeartEdgeVoxels * voxel_mm, seed);
}

glm::dvec3 heart_gradient(glm::dvec3 lps_mm, int frame, int frames, uint32_t seed,
                          double voxel_mm) {
  const dual::Point body = body_from_lps(dual::variable(lps_mm));
  return material_value(material_of(body, phase_of(frame, frames)), kHeartEdgeVoxels * voxel_mm,
                        seed)
      .slope;
}

glm::dvec3 heart_point(glm::dvec3 lps_mm, int from_frame, int to_frame, int frames) {
  const glm::dvec3 material = material_point(lps_mm, phase_of(from_frame, frames));
  return lps_from_body(frame_of(material, phase_of(to_frame, frames)));
}

Field heart_truth(const Grid& grid, int from_frame, int to_frame, int frames) {
  Field truth = still_field(grid);
  for_each_sample(grid, 1000.0, [&](size_t offset, glm::dvec3 lps_mm) {
    truth.u_mm[offset] = glm::vec3(heart_point(lps_mm, from_frame, to_frame, frames) - lps_mm);
  });
  return truth;
}

Mask heart_muscle(const Grid& grid, int frame, int frames, uint32_t seed) {
  Mask muscle{grid, std::vector<uint8_t>(grid.count())};
  const Phase phase = phase_of(frame, frames);
  for_each_sample(grid, 300.0, [&](size_t offset, glm::dvec3 lps_mm) {
    const glm::dvec3 p = material_point(lps_mm, phase);
    const double left = kLeft.distance(p);
    const double right = joined(kRight.distance(p), kConus.distance(p), 8.0);
    if (left > 0.0 && right > 0.0) return;
    const bool in_left = left <= 0.0 && left >= -left_wall(p, seed);
    const bool in_right = left > 0.0 && right >= -4.5;
    muscle.values[offset] = in_left || in_right;
  });
  return muscle;
}

}  // namespace palpate
