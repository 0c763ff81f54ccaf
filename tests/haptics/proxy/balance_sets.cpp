#include "tests/haptics/proxy/balance_sets.h"

#include <algorithm>
#include <cmath>

#include "tests/support/random.h"

namespace palpate::test {
namespace {

class Maker {
 public:
  explicit Maker(unsigned seed) : random_(seed) {}

  BalanceCase make() {
    BalanceCase result;
    const int count = 1 + pick(PrimitiveSet::kCapacity);
    result.stiffness_n_per_m = power(10.0, 1e5);
    middle_ = pick(2) ? random_.vector(0.5) : glm::dvec3(0.0);
    spread_ = power(1e-6, 0.5);
    places_ = pick(4);
    turns_ = pick(5);
    tilt_ = power(1e-14, 1e-2);
    wide_ = pick(2) == 1;
    strength_n_ = power(1e-6, 1e3);
    for (glm::dvec3& place : some_places_) place = middle_ + random_.vector(spread_);
    for (glm::dvec3& turn : some_turns_) turn = any_direction();
    for (int i = 0; i < count; ++i) result.primitives.add(primitive());
    result.probe = probe(result);
    return result;
  }

 private:
  int pick(int n) { return int(random_.draw(0.0, double(n))); }
  double power(double low, double high) {
    return std::exp(random_.draw(std::log(low), std::log(high)));
  }
  glm::dvec3 any_direction() {
    while (true) {
      const glm::dvec3 v = random_.vector(1.0);
      const double length = glm::length(v);
      if (length > 0.1 && length < 1.0) return v / length;
    }
  }

  glm::dvec3 place() {
    switch (places_) {
      case 0:
        return some_places_[0];
      case 1:
        return some_places_[size_t(pick(3))];
      case 2:
        return middle_ + spread_ * glm::round(random_.vector(2.0)) * 0.25;
      default:
        return middle_ + random_.vector(spread_);
    }
  }

  glm::dvec3 turn() {
    const double sign = pick(2) ? 1.0 : -1.0;
    switch (turns_) {
      case 0: {
        glm::dvec3 axis(0.0);
        axis[pick(3)] = sign;
        return axis;
      }
      case 1:
        return sign * some_turns_[size_t(pick(3))];
      case 2:
        return sign * glm::normalize(some_turns_[0] + tilt_ * random_.vector(1.0));
      case 3:
        return sign * glm::normalize(some_turns_[size_t(pick(3))] +
                                     double(pick(2)) * tilt_ * random_.vector(1.0));
      default:
        return any_direction();
    }
  }

  Primitive primitive() {
    Primitive result;
    const int kind = pick(16);  // as many planes as lines and points together; a few forces
    result.kind = kind < 8    ? Primitive::Kind::kPlane
                  : kind < 12 ? Primitive::Kind::kLine
                  : kind < 15 ? Primitive::Kind::kPoint
                              : Primitive::Kind::kForce;
    result.position = place();
    result.direction = turn();
    result.strength_n = wide_ ? power(1e-6, 1e3) : strength_n_ * random_.draw(0.2, 1.0);
    return result;
  }

  /// Close enough to a primitive that the primitive either holds the proxy or yields, at random.
  glm::dvec3 probe(const BalanceCase& made) {
    const Primitive& one = made.primitives[pick(made.primitives.count())];
    const double reach = one.strength_n / made.stiffness_n_per_m;
    switch (pick(4)) {
      case 0:
        return one.position;
      case 1:
        return one.position + random_.vector(std::min(2.0 * reach, 1.0));
      case 2:
        return one.position - one.direction * std::min(reach, 1.0) * random_.draw(0.0, 2.0);
      default:
        return middle_ + random_.vector(2.0 * spread_);
    }
  }

  Random random_;
  glm::dvec3 middle_{0.0};
  std::array<glm::dvec3, 3> some_places_{}, some_turns_{};
  double spread_ = 0.0, tilt_ = 0.0, strength_n_ = 0.0;
  int places_ = 0, turns_ = 0;
  bool wide_ = false;
};

}  // namespace

BalanceCase random_set(unsigned seed) {
  return Maker(seed).make();
}

}  // namespace palpate::test
