#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <thread>

#include <fmt/format.h>

#include "integration/devices/simulated.h"
#include "integration/devices/simulated_paths.h"
#include "module/haptics/servo/servo.h"
#include "module/haptics/servo/statistics.h"
#include "tests/lab/bench/feel_rows.h"
#include "tests/lab/stability/paper_loop.h"
#include "tests/lab/stability/shell.h"
#include "tests/lab/studies/hearts.h"

namespace palpate::bench {
namespace {

int64_t steady_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// Work that is always the same and uses no memory: a longer time than usual is caused by the
/// machine. About 2 us.
double fixed_work(double start) {
  // Volatile, so that the work stays between the two readings of the clock.
  volatile double at = start;
  double x = at;
  for (int i = 0; i < 400; ++i) x = 0.5 * x + 1.0 / (1.0 + x);
  at = x;
  return at;
}

/// The time of a kind of frame.
struct Timing {
  /// One frame, as measured.
  Histogram tick;
  /// The shorter of two runs of the same frame, so that it contains no interrupt.
  Histogram work;
  Histogram reference;  ///< the fixed work after each
  int64_t contact = 0;  ///< frames in which something was placed
  double pieces = 0.0, primitives = 0.0;
  double median_us() const { return 1e-3 * double(work.quantile_ns(0.5)); }
  double tail_us() const { return 1e-3 * double(work.quantile_ns(0.9999)); }
};

using Tick = std::function<TickOutput(const TickInput&)>;

/// A scene that is stepped twice per frame: palpate's frame or the paper's.
struct Contestant {
  std::string name;
  std::array<Tick, 2> twins;
  HeartHand hand;
  TickInput input;
  TickOutput last;
  std::unique_ptr<Timing> timing = std::make_unique<Timing>();
};

std::vector<std::shared_ptr<const MovingVolume>> data_for(int volumes, Moves moves) {
  return {size_t(volumes), heart_volume(moves != Moves::kBoth)};
}

/// A ball of 3 mm, or a pad of several points.
struct Tool {
  double radius_m = 0.0;
  int points = 1;
};

Contestant ours(std::string name, int volumes, int modes_of_each, Moves moves, Tool tool = {}) {
  const auto made = [&]() -> Tick {
    SceneSpec spec = hearts_spec(volumes, modes_of_each, moves);
    spec.tool_radius_m = tool.radius_m;
    spec.tool_points = tool.points;
    const auto loop =
        std::make_shared<stability::Hand>(spec, data_for(volumes, moves), HapticsOptions{});
    return [loop](const TickInput& in) { return loop->haptics.tick(in); };
  };
  return {std::move(name), {made(), made()}, HeartHand(volumes, moves)};
}

Contestant papers(std::string name, Moves moves) {
  const auto made = [&]() -> Tick {
    const auto loop = std::make_shared<stability::PaperHand>(
        hearts_spec(1, 1, moves, PosePath::kPaper, BackTracking::kPicard), data_for(1, moves));
    return [loop](const TickInput& in) { return loop->loop.tick(in); };
  };
  return {std::move(name), {made(), made()}, HeartHand(1, moves)};
}

/// One block of frames of one contestant.
void run_block(Contestant& contestant, int frames, bool count) {
  Timing& timing = *contestant.timing;
  double sink = 1.0;
  for (int i = 0; i < frames; ++i) {
    contestant.hand.next(contestant.input, contestant.last.first);
    std::array<int64_t, 2> took_ns{};
    std::array<TickOutput, 2> out;
    for (size_t twin = 0; twin < 2; ++twin) {
      const int64_t begin = steady_ns();
      out[twin] = contestant.twins[twin](contestant.input);
      took_ns[twin] = steady_ns() - begin;
    }
    if (out[0].proxy_m != out[1].proxy_m || out[0].wanted_n != out[1].wanted_n)
      throw Mismatch("Two runs of the same frame differ: " + contestant.name + ".");
    contestant.last = out[0];
    const int64_t begin = steady_ns();
    sink = fixed_work(sink);
    const int64_t reference_ns = steady_ns() - begin;
    if (!count) continue;
    // The first of the two, whose data may not be in the cache.
    timing.tick.add(took_ns[0]);
    timing.work.add(std::min(took_ns[0], took_ns[1]));
    timing.reference.add(reference_ns);
    timing.contact += contestant.last.primitives > 0;
    timing.pieces += contestant.last.substeps;
    timing.primitives += contestant.last.primitives;
  }
  if (!(sink > 0.0)) throw Mismatch("The fixed work came to nothing.");
}

/// All contestants in turn, block by block, so that a disturbance affects all equally. A pause of a
/// tenth follows each block: the system stops a real-time thread that never waits.
void run_all(std::vector<Contestant>& contestants, int64_t frames) {
  constexpr int kBlock = 5000;
  for (Contestant& c : contestants) run_block(c, kBlock, false);
  for (int64_t done = 0; done < frames; done += kBlock)
    for (Contestant& c : contestants) {
      const int64_t begin = steady_ns();
      run_block(c, kBlock, true);
      std::this_thread::sleep_for(std::chrono::nanoseconds((steady_ns() - begin) / 10));
    }
}

Table cost_table(const std::vector<Contestant>& contestants, const std::string& note) {
  Table table{"One haptic frame",
              note,
              {{"frame", "frame"},
               {"median_us", "work: median us"},
               {"p99_us", "p99 us"},
               {"p9999_us", "p99.99 us"},
               {"most_us", "most us"},
               {"raw_median_us", "as it came: median us"},
               {"raw_p9999_us", "p99.99 us"},
               {"machine_p9999_us", "fixed work: p99.99 over its median us"},
               {"contact_percent", "in contact %"},
               {"pieces", "pieces of the way"},
               {"primitives", "primitives"}},
              {}};
  for (const Contestant& c : contestants) {
    const Timing& t = *c.timing;
    const double all = double(t.tick.count());
    const auto us = [](int64_t ns, int digits) { return number(1e-3 * double(ns), digits); };
    table.rows.push_back({words(c.name), us(t.work.quantile_ns(0.5), 2),
                          us(t.work.quantile_ns(0.99), 2), us(t.work.quantile_ns(0.9999), 1),
                          us(t.work.most_ns(), 1), us(t.tick.quantile_ns(0.5), 2),
                          us(t.tick.quantile_ns(0.9999), 1),
                          us(t.reference.quantile_ns(0.9999) - t.reference.quantile_ns(0.5), 1),
                          number(100.0 * double(t.contact) / all, 0), number(t.pieces / all, 2),
                          number(t.primitives / all, 2)});
  }
  return table;
}

/// The servo thread as a program starts it, with a simulated device, for some seconds.
Table thread_table(double seconds) {
  devices::SimulatedOptions device_options;
  device_options.real_time = true;
  devices::PathPlace place;
  place.surface_m = {0.0, 0.028, 0.0};
  place.times = 100;
  device_options.path = devices::circle_path(place);
  devices::SimulatedDevice device(device_options);
  Haptics haptics({}, device.info());
  auto scene = plan(hearts_spec(1, 1, Moves::kBoth), data_for(1, Moves::kBoth));
  if (!scene) throw Mismatch(scene.error().message);
  haptics.adopt(Haptics::prepare(*scene));
  auto servo = Servo::start(device, haptics);
  if (!servo) throw Mismatch(servo.error().message);
  const int64_t end_ns = steady_ns() + int64_t(1e9 * seconds);
  bool long_frame = false;
  for (double t = 0.0; steady_ns() < end_ns; long_frame = !long_frame) {
    PoseUpdate pose;
    pose.transform.rotation = glm::angleAxis(1.5 * t, glm::dvec3(0.0, 1.0, 0.0));
    pose.time_ns = steady_ns();
    (*servo)->send(pose);
    const int wait_ms = long_frame ? 22 : 11;
    std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
    t += 1e-3 * wait_ms;
  }
  (*servo)->stop();
  const ServoStatistics& s = (*servo)->statistics();
  std::string note = fmt::format(
      "The servo thread at 1 kHz for {:.0f} s, simulated device, a beating heart whose transform "
      "comes from frames of 11 and 22 ms in turn; {} ticks, {} of them more than half a period "
      "late. Kernel: {}.",
      seconds, s.ticks.load(), s.all_misses(), (*servo)->report().kernel);
  for (const auto& item : (*servo)->report().items)
    note += fmt::format(" {}: {}", item.what, item.obtained ? "yes." : "no. " + item.sentence);
  Table table{"The servo thread",
              note,
              {{"time", "time"},
               {"median_us", "median us"},
               {"p99_us", "p99 us"},
               {"p999_us", "p99.9 us"},
               {"most_us", "most us"}},
              {}};
  const auto add = [&](const char* name, const Histogram& h) {
    const auto us = [](int64_t ns) { return number(1e-3 * double(ns), 1); };
    table.rows.push_back({words(name), us(h.quantile_ns(0.5)), us(h.quantile_ns(0.99)),
                          us(h.quantile_ns(0.999)), us(h.most_ns())});
  };
  add("waking later than asked for", s.lateness);
  add("from one waking to the next", s.period);
  add("the haptic frame", s.tick);
  add("an exchange with the simulated device", s.device);
  add("all the work of a period", s.work);
  return table;
}

std::vector<Goal> goals_of(const std::vector<Contestant>& c) {
  const auto us = [&](int at) { return c[size_t(at)].timing->median_us(); };
  const double paper_still = us(4), paper_moved = us(5), paper_both = us(6);
  std::vector<Goal> goals;
  goals.push_back({"a haptic frame, surface and friction on the phantom: static", "36 us", "us",
                   1.5, 0.5, us(0), 2, fmt::format("the paper's loop here {:.2f}", paper_still)});
  goals.push_back({"the same with dynamic transforms", "45 us", "us", 2.0, 0.7, us(1), 2,
                   fmt::format("the paper's loop here {:.2f}", paper_moved)});
  goals.push_back({"dynamic transforms over static",
                   "1.25",
                   "x",
                   1.3,
                   {},
                   us(1) / us(0),
                   2,
                   fmt::format("the paper's loop here {:.2f}", paper_moved / paper_still)});
  goals.push_back({"the same with transforms and moving data", "660 us", "us", 4.0, 2.0, us(2), 2,
                   fmt::format("the paper's loop here {:.2f}", paper_both)});
  goals.push_back({"transforms and moving data over static", "18", "x", 3.0, 2.0, us(2) / us(0), 2,
                   fmt::format("the paper's loop here {:.2f}", paper_both / paper_still)});
  const auto beside = [&](int at) {
    const Timing& t = *c[size_t(at)].timing;
    const auto tail = [](const Histogram& h) { return 1e-3 * double(h.quantile_ns(0.9999)); };
    return fmt::format("with interrupts {:.1f}; fixed work of {:.1f} beside it {:.1f}",
                       tail(t.tick), 1e-3 * double(t.reference.quantile_ns(0.5)),
                       tail(t.reference));
  };
  goals.push_back({"transforms and moving data, p99.99 of work",
                   "",
                   "us",
                   20.0,
                   {},
                   c[2].timing->tail_us(),
                   1,
                   beside(2)});
  goals.push_back({"8 modes on 4 moving volumes, p99.99 of work", "", "us", 40.0, 15.0,
                   c[3].timing->tail_us(), 1, fmt::format("median {:.1f}; ", us(3)) + beside(3)});
  return goals;
}

}  // namespace

Findings time_rows(const FeelBench& bench) {
  std::vector<Contestant> contestants;
  contestants.push_back(ours("static", 1, 1, Moves::kNothing));
  contestants.push_back(ours("dynamic transforms", 1, 1, Moves::kTransform));
  contestants.push_back(ours("transforms and moving data", 1, 1, Moves::kBoth));
  contestants.push_back(ours("8 modes on 4 moving volumes", 4, 2, Moves::kBoth));
  contestants.push_back(papers("the paper's loop, static", Moves::kNothing));
  contestants.push_back(papers("the paper's loop, dynamic transforms", Moves::kTransform));
  contestants.push_back(papers("the paper's loop, transforms and moving data", Moves::kBoth));
  for (const auto& [of, moves] : {std::pair("static", Moves::kNothing),
                                  std::pair("transforms and moving data", Moves::kBoth)}) {
    contestants.push_back(ours(fmt::format("{}, a ball of 3 mm", of), 1, 1, moves, {0.003, 1}));
    for (const int points : {3, 5})
      contestants.push_back(
          ours(fmt::format("{}, a pad of {} points", of, points), 1, 1, moves, {0.006, points}));
  }
  ServoReport report;
  const int64_t frames = bench.part(500'000);
  std::thread([&] {
    prepare_thread({.core = int(std::thread::hardware_concurrency()) - 1}, report);
    run_all(contestants, frames);
  }).join();
  std::string note = fmt::format(
      "{} frames each, back to back (caches warm), in blocks in turn; class Haptics with all its "
      "guards, on the heart phantom of 128^3; a reading of the clock is in each. Work: the shorter "
      "of two runs of the same frame, which are checked to give the same bits. The paper's loop: "
      "the same parts put together as the paper does, without sweep, tank and guards.",
      frames);
  for (const auto& item : report.items)
    if (item.what == "real-time priority") note += " Real-time priority: " + item.sentence;
  Findings findings;
  findings.goals = goals_of(contestants);
  findings.details.push_back(cost_table(contestants, note));
  findings.details.push_back(thread_table(bench.quick ? 1.0 : 20.0));
  return findings;
}

}  // namespace palpate::bench
