// The whole haptic step on a plane wall that moves by its transform, by its data, or by both, at
// 500 Hz and 1 kHz. Oracle: the closed form, force = stiffness * (wall - hand), cut at the limit.
// What the guards do beyond it has a cause.
#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <string_view>

#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kPlaneStiffness = 600.0;  // N/m
constexpr double kPlaneLimit_n = 4.0;
constexpr double kPlaneSwing_m = 0.004;
constexpr double kAway_m = 0.02;  // where the hand waits for the start
constexpr int kPlaneFrames = 16;  // in a cycle of a second
// The proxy follows a wall within half a micrometre.
constexpr double kFollows_n = 5e-4;
// What the guards hold back without saying so, and how far a proxy stays behind where hand and wall
// move fast.
constexpr double kUnsaid_n = 0.005 + 0.002;
constexpr double kReturn_n_per_s = 50.0;

enum class Moved { kNot, kByTransform, kByData, kByBoth };

std::string name_of(Moved moved) {
  constexpr const char* kNames[] = {"still", "moved by its transform", "moved by its data",
                                    "moved by both"};
  return kNames[int(moved)];
}

/// Solid at x < place_m, with an edge 1 mm soft.
class Plane final : public FrameData {
 public:
  explicit Plane(double place_m) : place_m_(place_m) {}
  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x) const noexcept override {
    return 500.0 * std::erfc((x.x - place_m_) / kSoft_m);
  }
  glm::dvec3 scalar_gradient(glm::dvec3 x) const noexcept override {
    const double t = (x.x - place_m_) / kSoft_m;
    return {-1000.0 / (std::sqrt(std::numbers::pi) * kSoft_m) * std::exp(-t * t), 0.0, 0.0};
  }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override { return scalar_gradient(x); }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override { return glm::dmat3(0.0); }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-0.048); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(0.048); }

 private:
  static constexpr double kSoft_m = 1.06e-3;
  double place_m_;
};

double frame_place_m(int frame, double swing_m) {
  return swing_m * std::sin(2.0 * std::numbers::pi * frame / kPlaneFrames);
}

std::shared_ptr<const MovingVolume> plane(double swing_m) {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  const Grid grid = shell_grid(8.0);
  Motion motion{"data", {}};
  const int frames = swing_m > 0.0 ? kPlaneFrames : 1;
  for (int k = 0; k < frames; ++k) {
    const double at = frame_place_m(k, swing_m);
    volume->frames.push_back(std::make_shared<Plane>(at));
    volume->times.times_s.push_back(double(k) / frames);
    const float step_mm = float(1e3 * (frame_place_m(k + 1, swing_m) - at));
    motion.steps.push_back(MotionMap::of(
        Field{grid, std::vector<glm::vec3>(grid.count(), glm::vec3(step_mm, 0.0F, 0.0F))}));
  }
  if (frames > 1) {
    volume->times.cycle_s = 1.0;
    volume->motions.push_back(motion);
  }
  return volume;
}

/// A hand on the wall, whose force is compared with the closed form in every tick.
class WallHand {
 public:
  WallHand(Moved moved, double period_s, double limit_n = kPlaneLimit_n)
      : period_s_(period_s), limit_n_(limit_n), haptics_(options(limit_n, period_s), device()) {
    const bool by_data = moved == Moved::kByData || moved == Moved::kByBoth;
    const bool by_transform = moved == Moved::kByTransform || moved == Moved::kByBoth;
    const double swing_m = moved == Moved::kByBoth ? 0.5 * kPlaneSwing_m : kPlaneSwing_m;
    data_swing_m_ = by_data ? swing_m : 0.0;
    SceneSpec spec = shell_spec(50.0, 0.0, kPlaneStiffness);
    if (by_transform) {
      spec.volumes[0].drive.kind = DriveSpec::Kind::kSwing;
      spec.volumes[0].drive.axis = {1.0, 0.0, 0.0};
      spec.volumes[0].drive.rate_hz = 1.0;
      spec.volumes[0].drive.amplitude_m = swing_m;
      spec.volumes[0].path = PosePath::kExact;
    }
    haptics_.adopt(Haptics::prepare(*plan(spec, {plane(data_swing_m_)})));
    for (double s = 0.0; s < 2.2; s += period_s) to(kAway_m);
    EXPECT_EQ(out.cause, Cause::kNone);
    forget();
  }

  /// One period with the hand at x.
  void to(double x_m) {
    const double before_n = felt_n(), before_deep_m = wall_m_ - x_m_;
    const double hand_step_m = std::abs(x_m - x_m_);
    const bool was_said = out.cause != Cause::kNone;
    input_.now_ns += std::llround(1e9 * period_s_);
    input_.dt_s = period_s_;
    input_.reading.position_m = {x_m, 0.0, 0.0};
    input_.reading.time_ns = input_.now_ns;
    input_.reading.fresh = true;
    out = haptics_.tick(input_);
    x_m_ = x_m;
    wall_m_ = haptics_.run()->volumes[0].offset.x;
    if (data_swing_m_ > 0.0) {
      const double here = frame_place_m(out.first.frame, data_swing_m_);
      wall_m_ +=
          here + out.first.phase * (frame_place_m(out.first.frame + 1, data_swing_m_) - here);
    }
    theory_n = std::clamp(kPlaneStiffness * (wall_m_ - x_m), 0.0, limit_n_);
    // What the wall gives in closed form is what the ledger begins with, and all of it is accounted
    // for.
    EXPECT_NEAR(out.ledger.asked_n.x - out.ledger[Limiter::kBridge].x,
                std::max(0.0, kPlaneStiffness * (wall_m_ - x_m)), kUnsaid_n);
    EXPECT_LT(glm::distance(out.ledger.left_n(), out.command.force_n), 1e-9);
    const double error_n = std::abs(felt_n() - theory_n);
    const double beyond_n =
        std::abs(felt_n() - before_n) - kPlaneStiffness * std::abs(wall_m_ - x_m - before_deep_m);
    time_s += period_s_;
    touched_s += theory_n > 0.0 ? period_s_ : 0.0;
    if (out.cause == Cause::kNone) {
      unsaid_error_n = std::max(unsaid_error_n, error_n);
      if (!was_said) unsaid_change_n = std::max(unsaid_change_n, beyond_n);
    } else {
      said_s += period_s_;
    }
    if (std::string_view(word(out.cause)) == "return") {
      returned_s += period_s_;
      const double may_n = kPlaneStiffness * hand_step_m + kReturn_n_per_s * period_s_;
      return_change_n = std::max(return_change_n, beyond_n - may_n);
    }
  }
  void forget() {
    unsaid_error_n = unsaid_change_n = said_s = returned_s = touched_s = time_s = 0.0;
    return_change_n = -1.0;
  }
  double felt_n() const { return out.command.force_n.x; }
  double period_s() const { return period_s_; }

  TickOutput out;
  double theory_n = 0.0;
  double unsaid_error_n = 0.0, unsaid_change_n = 0.0;
  double return_change_n = -1.0;  ///< beyond what the hand's motion and the rate allow
  double said_s = 0.0, returned_s = 0.0, touched_s = 0.0, time_s = 0.0;

 private:
  static HapticsOptions options(double limit_n, double period_s) {
    HapticsOptions options = unmetered();
    options.safety.max_force_n = limit_n;
    options.period_s = period_s;
    return options;
  }
  static DeviceInfo device() {
    DeviceInfo info = Hand::device();
    // Cool motors.
    info.max_force_n = 30.0;
    return info;
  }

  double period_s_, limit_n_, data_swing_m_ = 0.0;
  Haptics haptics_;
  TickInput input_;
  double wall_m_ = 0.0, x_m_ = kAway_m;
};

/// A hand of 1 kN/m and 27 N s/m that holds a grip of 0.2 kg.
struct SoftHand {
  double x_m, speed_m_per_s = 0.0;
  void step(double force_n, double target_m, double period_s) {
    constexpr int kSteps = 40;
    for (int i = 0; i < kSteps; ++i) {
      const double push_n = force_n - 1000.0 * (x_m - target_m) - 27.0 * speed_m_per_s;
      speed_m_per_s += push_n / 0.2 * period_s / kSteps;
      x_m += speed_m_per_s * period_s / kSteps;
    }
  }
};

void for_each_wall(const std::function<void(Moved, double)>& test) {
  for (const Moved moved : {Moved::kNot, Moved::kByTransform, Moved::kByData, Moved::kByBoth})
    for (const double period_s : {1e-3, 2e-3}) {
      SCOPED_TRACE(name_of(moved) + ", " + std::to_string(std::lround(1.0 / period_s)) + " Hz");
      test(moved, period_s);
    }
}

TEST(MovingWall, GivesARestingHandItsSpringUpToTheLimit) {
  for_each_wall([](Moved moved, double period_s) {
    for (const double deep_m : {0.002, 0.0045}) {
      WallHand hand(moved, period_s);
      // In slowly, then 5 s of rest.
      for (double s = 0.0; s < 6.0; s += period_s) hand.to(std::max(kAway_m - 0.04 * s, -deep_m));
      EXPECT_GT(hand.touched_s, 2.0);
      EXPECT_LT(hand.unsaid_error_n, kFollows_n) << deep_m;
      EXPECT_EQ(hand.said_s, 0.0) << word(hand.out.cause);
    }
  });
}

TEST(MovingWall, GivesASoftHandItsSpringAfterAPressToTheLimit) {
  for_each_wall([](Moved moved, double period_s) {
    WallHand hand(moved, period_s);
    SoftHand soft{kAway_m};
    for (double s = -1.0; s < 12.0; s += period_s) {
      // Roams, presses beyond the limit, then rests 6.5 mm behind the wall's middle.
      const double target_m = s < 0.0   ? -kAway_m * s
                              : s < 3.0 ? -0.004 + 0.006 * std::sin(4.4 * s)
                              : s < 3.5 ? -0.018
                                        : -0.0105;
      soft.step(hand.felt_n(), target_m, period_s);
      hand.to(soft.x_m);
    }
    EXPECT_GT(hand.touched_s, 9.0);
    EXPECT_LT(hand.unsaid_error_n, kUnsaid_n);
    EXPECT_LT(hand.unsaid_change_n, kUnsaid_n);
    EXPECT_LT(hand.return_change_n, kFollows_n);
    EXPECT_LT(hand.said_s, 0.5);
  });
}

TEST(MovingWall, ChangesATappingHandsForceOnlyAsItMovesOrWithACause) {
  for_each_wall([](Moved moved, double period_s) {
    for (const double speed_m_per_s : {0.3, 1.0}) {
      WallHand hand(moved, period_s);
      for (double s = 0.0; s < 8.0; s += period_s) {
        // In, every other time a rest of 0.2 s, and out again.
        const double deep_s = 0.026 / speed_m_per_s, rest_s = std::fmod(s, 1.0) < 0.5 ? 0.2 : 0.0;
        const double in_cycle = std::fmod(s, 0.5);
        const double share = in_cycle < deep_s ? in_cycle / deep_s
                             : in_cycle < deep_s + rest_s
                                 ? 1.0
                                 : std::max(0.0, 1.0 - (in_cycle - deep_s - rest_s) / deep_s);
        hand.to(kAway_m - 0.026 * share);
      }
      EXPECT_GT(hand.touched_s, 1.0);
      EXPECT_LT(hand.unsaid_error_n, kUnsaid_n) << speed_m_per_s;
      EXPECT_LT(hand.unsaid_change_n, kUnsaid_n) << speed_m_per_s;
      EXPECT_LT(hand.return_change_n, kFollows_n) << speed_m_per_s;
      if (speed_m_per_s == 1.0) {
        EXPECT_GT(hand.returned_s, 0.0);
      }
    }
  });
}

TEST(MovingWall, GivesARestingFingerItsForceSoonAfterAFastTouch) {
  for_each_wall([](Moved moved, double period_s) {
    for (const double speed_m_per_s : {0.3, 0.6, 1.0}) {
      WallHand hand(moved, period_s);
      SoftHand soft{kAway_m, -speed_m_per_s};
      double touched_s = -1.0;
      for (double s = 0.0; s < 1.0; s += period_s) {
        soft.step(hand.felt_n(), -0.0105, period_s);
        hand.to(soft.x_m);
        if (touched_s < 0.0 && hand.theory_n > 0.0) touched_s = s;
        if (touched_s < 0.0 || s < touched_s + 0.05) continue;
        if (s < touched_s + 0.3) {
          ASSERT_GT(hand.felt_n(), 0.7 * hand.theory_n) << speed_m_per_s << " m/s, " << s << " s";
        } else {
          ASSERT_GT(hand.felt_n(), 0.95 * hand.theory_n) << speed_m_per_s << " m/s, " << s << " s";
        }
      }
      EXPECT_LT(hand.unsaid_error_n, kUnsaid_n) << speed_m_per_s;
    }
  });
}

}  // namespace
}  // namespace palpate
