#include "module/haptics/proxy/ball_contact.h"

#include <array>
#include <cmath>

namespace palpate {
namespace {

constexpr int kMostAscents = 8;
// Radians: the ball is touched this close to its furthest point, 5e-9 of its radius beside it.
constexpr double kAtContact = 1e-4;

constexpr double kThird = 0.57735026918962576;  // 1 / sqrt(3)
constexpr std::array<glm::dvec3, 14> kAround = {{{1, 0, 0},
                                                 {-1, 0, 0},
                                                 {0, 1, 0},
                                                 {0, -1, 0},
                                                 {0, 0, 1},
                                                 {0, 0, -1},
                                                 {kThird, kThird, kThird},
                                                 {-kThird, kThird, kThird},
                                                 {kThird, -kThird, kThird},
                                                 {-kThird, -kThird, kThird},
                                                 {kThird, kThird, -kThird},
                                                 {-kThird, kThird, -kThird},
                                                 {kThird, -kThird, -kThird},
                                                 {-kThird, -kThird, -kThird}}};

}  // namespace

glm::dvec3 ball_contact(const FrameData& frame, glm::dvec3 centre, const ToolBall& ball,
                        glm::dvec3& last) noexcept {
  const ScalarSample middle = frame.scalar_and_gradient(centre);
  // Directions are those of the ball of radius 1: M takes it to the data, its transpose gradients
  // back.
  const glm::dmat3& m = ball.data_from_ball;
  const auto direction_of = [&](glm::dvec3 gradient) {
    const glm::dvec3 uphill = gradient * m;
    const double length = glm::length(uphill);
    return length > 0.0 ? uphill / length : glm::dvec3(0.0);
  };

  // The greatest of some places.
  glm::dvec3 best(0.0);
  double greatest = middle.value;
  const auto look = [&](glm::dvec3 direction) {
    const double value = frame.scalar(centre + m * direction);
    if (!(value > greatest) && !std::isnan(greatest)) return;
    greatest = value;
    best = direction;
  };
  if (const glm::dvec3 uphill = direction_of(middle.gradient); uphill != glm::dvec3(0.0))
    look(uphill);
  if (last != glm::dvec3(0.0)) look(last);
  for (const glm::dvec3& direction : kAround) look(direction);

  // Uphill from there on the ball, in steps to where the gradient points, halved where the value
  // does not rise.
  double step = 1.0;
  ScalarSample here = frame.scalar_and_gradient(centre + m * best);
  for (int i = 0; best != glm::dvec3(0.0) && i < kMostAscents; ++i) {
    const glm::dvec3 uphill = direction_of(here.gradient);
    const glm::dvec3 aside = uphill - glm::dot(uphill, best) * best;
    if (!(glm::length(aside) > kAtContact)) break;
    const glm::dvec3 next = glm::normalize(best + step * (uphill - best));
    const ScalarSample there = frame.scalar_and_gradient(centre + m * next);
    if (there.value > here.value) {
      best = next;
      here = there;
    } else {
      step *= 0.5;
    }
  }
  last = best;
  return centre + m * best;
}

}  // namespace palpate
