#include <algorithm>
#include <glm/gtc/constants.hpp>

#include <fmt/format.h>

#include "module/scene/drive.h"
#include "tests/lab/bench/feel_rows.h"
#include "tests/lab/stability/shell.h"

namespace palpate::bench {
namespace {

/// The change of the force on a hand at rest on a moving ball from one millisecond to the next.
struct Ticks {
  double step_n = 0.0;  ///< largest change of the force in a ms
  double kink_n = 0.0;  ///< largest change of that change
};

/// The ball swings below the hand, by 10 mm to either side once in 2 s; poses come from graphics
/// frames of alternately 11 and 22 ms.
Ticks felt(PosePath path, double seconds) {
  DriveSpec drive;
  drive.kind = DriveSpec::Kind::kSwing;
  drive.axis = {1.0, 0.0, 0.0};
  drive.rate_hz = 0.5;
  drive.amplitude_m = 0.010;
  SceneSpec spec = stability::shell_spec(20.0, 0.0, 600.0);
  VolumeSpec& volume = spec.volumes.front();
  volume.path = path;
  volume.drive = drive;
  if (path != PosePath::kExact) volume.drive.kind = DriveSpec::Kind::kSecondHand;
  stability::Hand hand(spec, {stability::shell(1, 1.0)});
  Ticks ticks;
  glm::dvec3 last(0.0), last_step(0.0);
  double next_pose_s = 0.0;
  bool long_frame = false;
  const int settled = 5000;
  for (int i = 1; i < int(1e3 * seconds); ++i) {
    if (const double t = 1e-3 * i; t >= next_pose_s && path != PosePath::kExact) {
      hand.input.pose_count = 1;
      hand.input.poses[0] = {0, driven(drive, Transform{}, t), int64_t(i) * 1'000'000};
      next_pose_s += long_frame ? 0.0222 : 0.0111;
      long_frame = !long_frame;
    }
    // Always in contact, 3 to 23 mm deep.
    const glm::dvec3 force = hand.to({0.012, 0.0, 0.0}).wanted_n;
    const glm::dvec3 step = force - last;
    if (i > settled) {
      ticks.step_n = std::max(ticks.step_n, glm::length(step));
      ticks.kink_n = std::max(ticks.kink_n, glm::length(step - last_step));
    }
    last = force;
    last_step = step;
  }
  return ticks;
}

}  // namespace

Findings frame_end_rows(const FeelBench& bench) {
  const double seconds = bench.quick ? 10.0 : 60.0;
  const Ticks smooth = felt(PosePath::kSmooth, seconds), paper = felt(PosePath::kPaper, seconds),
              exact = felt(PosePath::kExact, seconds);
  Findings findings;
  findings.goals.push_back({"frame times 2:1: force step in a ms beyond the exact path",
                            "a visible tick (Fig. 15)", "N", 0.02, 0.0,
                            std::max(0.0, smooth.step_n - exact.step_n), 5,
                            fmt::format("the paper's path {:.4f}; the exact path's own step {:.4f}",
                                        paper.step_n - exact.step_n, exact.step_n)});
  Table table{"Ticks at the ends of graphics frames",
              "A ball swings below a hand at rest, poses every 11 and 22 ms in turn; after 5 s.",
              {{"path", "path"},
               {"step_n", "largest force step in a ms, N"},
               {"kink_n", "largest change of that step, N"}},
              {}};
  const auto add = [&](const char* name, const Ticks& t) {
    table.rows.push_back({words(name), number(t.step_n, 5), number(t.kink_n, 5)});
  };
  add("smooth", smooth);
  add("paper", paper);
  add("exact", exact);
  findings.details.push_back(table);
  return findings;
}

}  // namespace palpate::bench
