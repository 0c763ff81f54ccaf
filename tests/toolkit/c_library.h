#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "integration/toolkit/palpate.h"

namespace palpate::test {

/// PAL_OK, or a failed test with the library's message.
#define PAL_EXPECT_OK(call) EXPECT_EQ((call), PAL_OK) << pal_last_error()
#define PAL_ASSERT_OK(call) ASSERT_EQ((call), PAL_OK) << pal_last_error()

/// Handles that are closed at the end of a test, also of a failed one.
struct Opened {
  PalContext* context = nullptr;
  PalScene* scene = nullptr;
  PalSession* session = nullptr;
  PalView* view = nullptr;
  ~Opened() {
    pal_view_close(&view);
    pal_session_close(&session);
    pal_scene_close(&scene);
    pal_context_close(&context);
  }
};

inline PalContextInfo context_info(uint32_t flags = PAL_CONTEXT_NO_GPU) {
  PalContextInfo info{};
  info.size = sizeof info;
  info.version = PAL_VERSION;
  info.flags = flags;
  return info;
}

inline PalDeviceInfo host_device() {
  PalDeviceInfo info{};
  info.size = sizeof info;
  info.max_force_n = 10.0;
  info.workspace_radius_m = 1.0;
  return info;
}

/// A force device of the host's; `about` is borrowed.
inline PalDevice device_of(const PalDeviceInfo& about, void* user,
                           void (*exchange)(void*, const double*, PalReading*)) {
  PalDevice device{};
  device.size = sizeof device;
  device.info = &about;
  device.user = user;
  device.exchange = exchange;
  return device;
}

/// A still ball of 20 mm radius in memory, 1000 inside and 0 outside, 32 voxels of 2 mm along each
/// axis.
struct BallFrames {
  explicit BallFrames(int frames = 1) : samples(size_t(frames)) {
    for (int f = 0; f < frames; ++f)
      for (int k = 0; k < 32; ++k)
        for (int j = 0; j < 32; ++j)
          for (int i = 0; i < 32; ++i) {
            const double r = 2.0 * std::hypot(i - 15.5, std::hypot(j - 15.5, k - 15.5));
            const double radius = 20.0 + 1.5 * f;
            samples[size_t(f)].push_back(float(1000.0 / (1.0 + std::exp((r - radius) / 1.0))));
          }
    for (const auto& frame : samples) pointers.push_back(frame.data());
    info.size = sizeof info;
    info.name = "ball";
    for (int a = 0; a < 3; ++a) {
      info.grid.size[a] = 32;
      info.grid.spacing_mm[a] = 2.0;
      info.grid.origin_mm[a] = -31.0;
    }
    info.sample_type = PAL_FLOAT32;
    info.frames = pointers.data();
    info.frame_count = uint32_t(frames);
  }
  std::vector<std::vector<float>> samples;
  std::vector<const void*> pointers;
  PalFrames info{};
};

/// A scene of one path (borrowed), which may be the name of frames in memory.
inline PalSceneInfo scene_info(const char* const* path, uint32_t flags = 0,
                               const PalFrames* frames = nullptr) {
  PalSceneInfo info{};
  info.size = sizeof info;
  info.flags = flags;
  info.paths = path;
  info.path_count = 1;
  info.frames = frames;
  info.frame_sets = frames ? 1 : 0;
  return info;
}

/// Opens a context without a device, the ball, and a session that the test ticks.
inline void open_ball(Opened& opened, const BallFrames& ball, uint32_t scene_flags = 0) {
  const PalContextInfo context = context_info();
  PAL_ASSERT_OK(pal_context_open(&context, &opened.context));
  const char* path = "ball";
  const PalSceneInfo scene = scene_info(&path, scene_flags, &ball.info);
  PAL_ASSERT_OK(pal_scene_open(opened.context, &scene, &opened.scene));
  const PalDeviceInfo device = host_device();
  PalSessionInfo session{};
  session.size = sizeof session;
  session.flags = PAL_SESSION_HOST_TICKS;
  session.host = &device;
  PAL_ASSERT_OK(pal_session_open(opened.scene, &session, &opened.session));
}

/// A host's hand that moves along z.
struct HostHand {
  PalSession* session = nullptr;
  int64_t time_ns = 5'000'000'000;
  double force_n[3] = {0.0, 0.0, 0.0};
  double worst_change_n = 0.0;

  double at(double z_m) {
    const double before[3] = {force_n[0], force_n[1], force_n[2]};
    const PalTick tick{{0.0, 0.0, z_m}, time_ns += 1'000'000, 0};
    EXPECT_EQ(pal_haptics_tick(session, &tick, force_n), PAL_OK) << pal_last_error();
    worst_change_n = std::max(
        worst_change_n, std::hypot(force_n[0] - before[0],
                                   std::hypot(force_n[1] - before[1], force_n[2] - before[2])));
    return size();
  }
  double size() const { return std::hypot(force_n[0], std::hypot(force_n[1], force_n[2])); }
  /// Moves slowly in until the force is larger than wanted_n. Returns the place, m, or 0.
  double press(double wanted_n) {
    for (double z_m = 0.03; z_m > 0.0; z_m -= 5e-6)
      if (at(z_m) > wanted_n) return z_m;
    return 0.0;
  }
};

}  // namespace palpate::test
