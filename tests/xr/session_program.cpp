// A program that runs in a headset and prints its events, one line each: for runtimes that can not
// be in the test's own process. usage: xr_session_program FRAMES SESSION SECONDS: ends cleanly
// after FRAMES pictures in its session number SESSION; gives up after SECONDS.

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "module/xr/headset.h"
#include "module/xr/vibration.h"
#include "tests/xr/gradient_source.h"

namespace {

int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

void say_hands(const palpate::xr::Hands& hands) {
  for (size_t side = 0; side < 2; ++side) {
    const palpate::xr::Controller& hand = hands.hand[side];
    const glm::dvec3 at = hand.world_from_grip.position_m;
    std::printf("hand %zu active %d at %.3f %.3f %.3f profile %s\n", side, int(hand.active), at.x,
                at.y, at.z, hand.profile.c_str());
  }
}

}  // namespace

int main(int count, char** arguments) {
  using namespace palpate;
  if (count != 4) return 2;
  const uint64_t wanted_frames = uint64_t(std::atoll(arguments[1]));
  const uint64_t wanted_session = uint64_t(std::atoll(arguments[2]));
  const int64_t deadline = monotonic_ns() + std::atoll(arguments[3]) * 1'000'000'000;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);

  test::GradientSource source;
  xr::Headset headset({.origin = xr::Origin::kLocalFloor}, source);
  xr::HeadsetState last = xr::HeadsetState::kEnded;
  uint64_t session = 0, drawn_before = 0;
  int64_t ahead_ns = 0;
  source.on_frame = [&](const xr::HeadsetFrame& frame) {
    ahead_ns = frame.display_time_ns - monotonic_ns();
  };
  bool ending = false;
  while (monotonic_ns() < deadline) {
    const xr::Report& report = headset.step(monotonic_ns());
    if (!report.sentence.empty()) std::printf("sentence %s\n", report.sentence.c_str());
    if (report.state != last) std::printf("state %s\n", xr::name(report.state));
    last = report.state;
    if (report.state == xr::HeadsetState::kEnded || report.state == xr::HeadsetState::kNoRuntime)
      break;
    if (report.sessions != session) drawn_before = report.drawn;
    session = report.sessions;
    if (report.state == xr::HeadsetState::kFocused)
      for (const int hand : {0, 1}) headset.vibrate(hand, xr::vibration(1.0, 4.0));
    const uint64_t drawn = report.drawn - drawn_before;
    if (drawn > 0 && drawn % 10 == 0) std::printf("drawn %d\n", int(drawn));
    if (!ending && session >= wanted_session && drawn >= wanted_frames) {
      say_hands(report.hands);
      std::printf("origin %s rate %g of %zu\n", xr::name(report.origin), report.display.hz,
                  report.display.offered_hz.size());
      std::printf("depth %d ahead_ms %.1f exact %d size %ux%u devices %d\n", int(report.depth),
                  double(ahead_ns) * 1e-6, int(source.last->display_time_exact),
                  source.last->color.size.width, source.last->color.size.height, source.uses);
      headset.end(monotonic_ns());
      ending = true;
    }
    if (report.state == xr::HeadsetState::kWaiting || report.state == xr::HeadsetState::kIdle) {
      const timespec pause{0, 10'000'000};
      nanosleep(&pause, nullptr);
    }
  }
  return last == xr::HeadsetState::kEnded ? 0 : 1;
}
