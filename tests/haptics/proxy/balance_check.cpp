#include "tests/haptics/proxy/balance_check.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace palpate::test {
namespace {

using Kind = Primitive::Kind;

/// Sums of forces of 1e3 N must cancel to 1e-9 N, and the search for the shortest vector multiplies
/// them: this needs more digits than long double has. Quad is the compiler's own type; it is slow,
/// so it is tried second.
#ifdef __SIZEOF_FLOAT128__
__extension__ using Quad = __float128;
#else
using Quad = long double;
#endif

template <class T>
struct Vec3 {
  T x{}, y{}, z{};
  Vec3() = default;
  Vec3(T a, T b, T c) : x(a), y(b), z(c) {}
  explicit Vec3(glm::dvec3 v) : x(T(v.x)), y(T(v.y)), z(T(v.z)) {}
  Vec3 operator+(Vec3 b) const { return {x + b.x, y + b.y, z + b.z}; }
  Vec3 operator-(Vec3 b) const { return {x - b.x, y - b.y, z - b.z}; }
  Vec3 operator-() const { return {-x, -y, -z}; }
  Vec3 operator*(T s) const { return {x * s, y * s, z * s}; }
  Vec3& operator+=(Vec3 b) { return *this = *this + b; }
  Vec3& operator-=(Vec3 b) { return *this = *this - b; }
};

template <class T>
T dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
T root(T a) {
  const T x = T(std::sqrt(static_cast<long double>(a)));
  return x > T(0) ? (x + a / x) / T(2) : x;  // one step of Newton's method doubles the digits
}

template <class T>
T length(Vec3<T> v) {
  return root(dot(v, v));
}

template <class T>
Vec3<T> unit(Vec3<T> v) {
  const T size = length(v);
  return size > T(0) ? v * (T(1) / size) : v;
}

/// The forces that one primitive can give at a place. A plane: q times 0 to s. A line or point: a
/// part of the ball of radius s in the space perpendicular to q, namely the directions within an
/// angle of `towards`, and their hull. The angle is stored as its sine, because its cosine may
/// round to 1.
template <class T>
struct Giver {
  bool flat = false, any_direction = true;
  Vec3<T> q{}, towards{}, force{};
  T strength{}, sine{};

  Vec3<T> nearest(Vec3<T> wanted) const {
    if (flat) return q * std::clamp<T>(dot(wanted, q), T(0), strength);
    wanted -= q * dot(wanted, q);
    const T wide = length(wanted);
    const Vec3<T> in_ball = wide > strength ? wanted * (strength / wide) : wanted;
    if (any_direction || (wide > strength && in_angle(in_ball))) return in_ball;
    if (wide <= strength && dot(wanted, towards) >= least()) return wanted;
    Vec3<T> side = across(wanted);
    if (const T far = length(side); far > strength * sine) side = side * (strength * sine / far);
    return towards * least() + side;
  }

  /// The force with the largest component along a direction.
  Vec3<T> farthest(Vec3<T> along) const {
    if (flat) return dot(along, q) > T(0) ? q * strength : Vec3<T>();
    // The second pass removes the round-off of a direction that is nearly parallel to q.
    for (int again = 0; again < 2; ++again) along = unit(along - q * dot(along, q));
    const Vec3<T> on_ball = along * strength;
    if (any_direction || in_angle(on_ball)) return on_ball;
    return towards * least() + unit(across(along)) * (strength * sine);
  }

 private:
  T least() const { return strength * root(T(1) - sine * sine); }
  Vec3<T> across(Vec3<T> v) const { return v - towards * dot(v, towards); }
  bool in_angle(Vec3<T> on_ball) const {
    return dot(on_ball, towards) > T(0) && length(across(on_ball)) <= strength * sine;
  }
};

template <class T>
Vec3<T> perpendicular(const Primitive& p, Vec3<T> from) {
  if (p.kind == Kind::kPoint) return from;
  const Vec3<T> q = unit(Vec3<T>(p.direction));
  return from - q * dot(q, from);
}

/// The forces at a place: the fixed ones, and the primitives whose force may vary.
template <class T>
struct Forces {
  Vec3<T> fixed{};
  std::vector<Giver<T>> givers;
};

template <class T>
Forces<T> forces_at(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                    glm::dvec3 proxy) {
  Forces<T> result;
  result.fixed = (Vec3<T>(probe) - Vec3<T>(proxy)) * T(stiffness_n_per_m);
  glm::dvec3 pulled = probe;
  for (const Primitive& p : primitives) {
    if (p.kind != Kind::kForce) continue;
    result.fixed += Vec3<T>(p.direction) * T(p.strength_n);
    pulled += p.strength_n / stiffness_n_per_m * p.direction;
  }
  for (const Primitive& p : primitives) {
    if (p.kind == Kind::kForce) continue;
    const T slack =
        T(kPlaceSlack * std::max({largest_of(proxy), largest_of(p.position), largest_of(probe),
                                  largest_of(pulled), kSmallestPlace}));
    Giver<T> giver;
    giver.strength = T(p.strength_n);
    giver.flat = p.kind == Kind::kPlane;
    if (p.kind != Kind::kPoint) giver.q = unit(Vec3<T>(p.direction));
    const Vec3<T> from = Vec3<T>(proxy) - Vec3<T>(p.position);
    if (giver.flat) {
      const T height = dot(from, giver.q);
      if (height > slack) continue;
      if (height < -slack) {
        result.fixed += giver.q * giver.strength;
        continue;
      }
    } else if (const Vec3<T> offset = perpendicular(p, from); length(offset) > slack) {
      giver.any_direction = false;
      giver.towards = -unit(offset);
      giver.sine = slack / length(offset);
    }
    result.givers.push_back(giver);
  }
  return result;
}

/// Each primitive in turn makes the remaining force as short as it can. Fast if they are not nearly
/// parallel.
template <class T>
T sweep(Forces<T> forces, T enough) {
  Vec3<T> rest = forces.fixed;
  for (Giver<T>& giver : forces.givers) {
    giver.force = giver.nearest({});
    rest += giver.force;
  }
  for (int k = 0; k < 300 && length(rest) > enough; ++k)
    for (Giver<T>& giver : forces.givers) {
      const Vec3<T> others = rest - giver.force;
      giver.force = giver.nearest(-others);
      rest = others + giver.force;
    }
  return length(rest);
}

/// Weights of the affine combination of points that is nearest to 0, by Gram-Schmidt, done twice.
template <class T>
std::vector<T> nearest_combination(const std::vector<Vec3<T>>& points) {
  const size_t edges = points.size() - 1;
  std::vector<Vec3<T>> basis;
  std::vector<std::vector<T>> upper(edges, std::vector<T>(edges, T(0)));
  for (size_t j = 0; j < edges; ++j) {
    Vec3<T> v = points[j + 1] - points[0];
    for (int again = 0; again < 2; ++again)
      for (size_t i = 0; i < j; ++i) {
        const T part = dot(basis[i], v);
        upper[i][j] += part;
        v -= basis[i] * part;
      }
    upper[j][j] = length(v);
    basis.push_back(unit(v));
  }
  std::vector<T> weights(points.size(), T(0));
  T sum = T(0);
  for (size_t j = edges; j-- > 0;) {
    T value = -dot(basis[j], points[0]);
    for (size_t i = j + 1; i < edges; ++i) value -= upper[j][i] * weights[i + 1];
    weights[j + 1] = upper[j][j] > T(0) ? value / upper[j][j] : T(0);
    sum += weights[j + 1];
  }
  weights[0] = T(1) - sum;
  return weights;
}

/// The shortest vector of the hull of points. Removes the points that do not take part in it.
template <class T>
Vec3<T> shortest_of(std::vector<Vec3<T>>& points, std::vector<T>& weights) {
  while (true) {
    const std::vector<T> wanted = nearest_combination(points);
    T part = T(1);
    size_t leaving = points.size();
    for (size_t i = 0; i < points.size(); ++i) {
      if (wanted[i] > T(0)) continue;
      const T limit = weights[i] > wanted[i] ? weights[i] / (weights[i] - wanted[i]) : T(0);
      if (leaving == points.size() || limit < part) {
        part = limit;
        leaving = i;
      }
    }
    for (size_t i = 0; i < points.size(); ++i) weights[i] += part * (wanted[i] - weights[i]);
    if (leaving == points.size()) break;
    points.erase(points.begin() + std::ptrdiff_t(leaving));
    weights.erase(weights.begin() + std::ptrdiff_t(leaving));
  }
  Vec3<T> sum;
  for (size_t i = 0; i < points.size(); ++i) sum += points[i] * weights[i];
  return sum;
}

/// Wolfe's method for the shortest vector of a convex set that is given by its farthest point along
/// a direction (P. Wolfe, Finding the nearest point in a polytope, 1976): finite for planes, and
/// fast for round sets.
template <class T>
T wolfe(const Forces<T>& forces, T enough) {
  const auto farthest = [&](Vec3<T> along) {
    Vec3<T> sum = forces.fixed;
    for (const Giver<T>& giver : forces.givers) sum += giver.farthest(along);
    return sum;
  };
  std::vector<Vec3<T>> points{farthest(-forces.fixed)};
  std::vector<T> weights{T(1)};
  Vec3<T> shortest = points[0];
  T best = length(shortest);
  for (int k = 0; k < 3000 && best > enough && points.size() < 4; ++k) {
    const Vec3<T> point = farthest(-shortest);
    if (dot(shortest, shortest - point) <= T(0)) break;  // no shorter one exists
    points.push_back(point);
    weights.push_back(T(0));
    shortest = shortest_of(points, weights);
    best = std::min<T>(best, length(shortest));
  }
  return best;
}

}  // namespace

double residual_n(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                  glm::dvec3 proxy, double enough_n) {
  if (!std::isfinite(proxy.x + proxy.y + proxy.z)) return HUGE_VAL;
  const long double quick =
      sweep<long double>(forces_at<long double>(primitives, probe, stiffness_n_per_m, proxy),
                         static_cast<long double>(enough_n));
  if (quick <= enough_n) return double(quick);
  return double(std::min<Quad>(
      Quad(quick),
      wolfe<Quad>(forces_at<Quad>(primitives, probe, stiffness_n_per_m, proxy), Quad(enough_n))));
}

long double objective_j(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                        glm::dvec3 x) {
  using Vec = Vec3<long double>;
  const Vec spring = Vec(x) - Vec(probe);
  long double sum = 0.5L * static_cast<long double>(stiffness_n_per_m) * dot(spring, spring);
  for (const Primitive& p : primitives) {
    const Vec from = Vec(x) - Vec(p.position);
    const long double s = p.strength_n;
    if (p.kind == Kind::kPlane)
      sum += s * std::max(0.0L, -dot(from, unit(Vec(p.direction))));
    else if (p.kind == Kind::kForce)
      sum -= s * dot(Vec(p.direction), Vec(x));
    else
      sum += s * length(perpendicular(p, from));
  }
  return sum;
}

glm::dvec3 slow_balance(const PrimitiveSet& primitives, glm::dvec3 probe, double stiffness_n_per_m,
                        int sweeps) {
  using Vec = Vec3<long double>;
  const long double k = stiffness_n_per_m;
  std::vector<Vec> moved(size_t(primitives.count()));
  Vec x(probe);
  for (const Primitive& p : primitives)
    if (p.kind == Kind::kForce) x += Vec(p.direction) * (p.strength_n / k);
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (int i = 0; i < primitives.count(); ++i) {
      const Primitive& p = primitives[i];
      if (p.kind == Kind::kForce) continue;
      Vec& move = moved[size_t(i)];
      const Vec without = x - move;
      const Vec from = without - Vec(p.position);
      const long double reach = p.strength_n / k;
      if (p.kind == Kind::kPlane) {
        const Vec q = unit(Vec(p.direction));
        move = q * std::clamp(-dot(from, q), 0.0L, reach);
      } else {
        const Vec offset = perpendicular(p, from);
        const long double far = length(offset);
        move = far > reach ? offset * (-reach / far) : -offset;
      }
      x = without + move;
    }
  return {double(x.x), double(x.y), double(x.z)};
}

}  // namespace palpate::test
