// The cost of the C library for a host: the tick in its own loop compared with the servo loop's,
// and a picture in its images compared with one in the renderer's own buffers. The two of each
// comparison alternate, and must give the same result before they are timed.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "integration/toolkit/palpate.h"
#include "module/haptics/scene_ticker.h"
#include "module/haptics/servo/servo_loop.h"
#include "module/scene/built_in.h"
#include "module/scene/make_volume.h"
#include "module/view/volume_renderer.h"
#include "tests/view/host_image.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_of(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

void must(bool fine, const std::string& what) {
  if (!fine) throw std::runtime_error(what);
}

/// Pressing into the heart and out again, once in four seconds.
glm::dvec3 hand_at(int64_t tick) {
  return {0.0, 0.0, 0.055 + 0.025 * std::cos(1.57e-3 * double(tick))};
}

struct FixedClock final : ServoClock {
  int64_t now_ns() noexcept override { return now; }
  void sleep_until(int64_t time_ns) noexcept override { now = std::max(now, time_ns); }
  int64_t now = 5'000'000'000;
};

struct FixedDevice final : ForceDevice {
  explicit FixedDevice(FixedClock& of) : clock(of) {}
  DeviceInfo info() const override {
    DeviceInfo info;
    info.kind = info.name = "bench";
    info.max_force_n = 8.0;
    info.workspace_radius_m = 0.1;
    info.buttons = 32;
    return info;
  }
  DeviceReading exchange(const DeviceCommand& command) noexcept override {
    force_n = command.force_n;
    DeviceReading reading;
    reading.position_m = hand_at(tick);
    reading.time_ns = clock.now;
    reading.fresh = true;
    return reading;
  }
  FixedClock& clock;
  int64_t tick = 0;
  glm::dvec3 force_n{0.0};
};

void bench_tick() {
  SceneSpec spec = heart_scene();
  auto data = build(spec.volumes[0]);
  must(bool(data), "the heart can not be built");
  const auto start = start_transform(spec.volumes[0], *data);
  spec.volumes[0].transform = *start;
  auto scene = plan(spec, {std::make_shared<const MovingVolume>(std::move(*data))});
  must(bool(scene), "the heart can not be assembled");
  FixedClock clock;
  FixedDevice device(clock);
  HapticsOptions haptics;
  haptics.safety.max_force_n = spec.max_force_n;
  SceneTicker ticker(haptics, device.info());
  must(ticker.offer(*scene), "the heart is not taken");
  ServoPorts ports;
  LoopOptions loop_options;
  loop_options.exchanges = Exchanges::kTwice;
  ServoLoop loop(device, ticker, clock, ports, loop_options);

  PalContextInfo context_info{};
  context_info.size = sizeof context_info;
  context_info.version = PAL_VERSION;
  context_info.flags = PAL_CONTEXT_NO_GPU;
  PalContext* context = nullptr;
  must(pal_context_open(&context_info, &context) == PAL_OK, pal_last_error());
  const char* path = "heart";
  PalSceneInfo scene_info{};
  scene_info.size = sizeof scene_info;
  scene_info.paths = &path;
  scene_info.path_count = 1;
  PalScene* pal_scene = nullptr;
  must(pal_scene_open(context, &scene_info, &pal_scene) == PAL_OK, pal_last_error());
  PalDeviceInfo host{};
  host.size = sizeof host;
  host.max_force_n = 8.0;
  host.workspace_radius_m = 0.1;
  PalSessionInfo session_info{};
  session_info.size = sizeof session_info;
  session_info.flags = PAL_SESSION_HOST_TICKS;
  session_info.host = &host;
  PalSession* session = nullptr;
  must(pal_session_open(pal_scene, &session_info, &session) == PAL_OK, pal_last_error());

  constexpr int kBlock = 500, kBlocks = 80;
  std::vector<double> servo_us, host_us;
  int64_t host_tick = 0;
  double most_n = 0.0;
  std::vector<glm::dvec3> expected(kBlock);
  for (int block = 0; block < kBlocks; ++block) {
    auto begin = Clock::now();
    for (int k = 0; k < kBlock; ++k) {
      ++device.tick;
      loop.run_period();
      expected[size_t(k)] = device.force_n;
    }
    servo_us.push_back(1e6 * seconds_of(begin) / kBlock);
    begin = Clock::now();
    for (int k = 0; k < kBlock; ++k) {
      const glm::dvec3 x = hand_at(++host_tick);
      const PalTick tick{{x.x, x.y, x.z}, 5'000'000'000 + host_tick * 1'000'000, 0};
      double force_n[3];
      pal_haptics_tick(session, &tick, force_n);
      must(glm::dvec3(force_n[0], force_n[1], force_n[2]) == expected[size_t(k)],
           fmt::format("tick {} has another force", host_tick));
      most_n = std::max(most_n, std::abs(force_n[2]));
    }
    host_us.push_back(1e6 * seconds_of(begin) / kBlock);
  }
  must(most_n > 0.5, "nothing was touched");
  std::vector<double> more;
  for (size_t b = 0; b < servo_us.size(); ++b) more.push_back(host_us[b] - servo_us[b]);
  fmt::print(
      "tick      servo loop {:.3f} us, pal_haptics_tick {:.3f} us, {:+.3f} us more (medians of {} "
      "blocks of {}; "
      "forces equal bit by bit)\n",
      median(servo_us), median(host_us), median(more), kBlocks, kBlock);
  pal_session_close(&session);
  pal_scene_close(&pal_scene);
  pal_context_close(&context);
}

void bench_view(PictureSize size) {
  auto context = vulkan::Context::open({});
  must(bool(context), context ? "" : context.error().message);
  SceneSpec spec = heart_scene();
  auto data = build(spec.volumes[0]);
  const auto volume = std::make_shared<const MovingVolume>(std::move(*data));
  auto renderer = VolumeRenderer::make(*context, {.most = size});
  must(bool(renderer), "no renderer");
  must(bool((*renderer)->set_volumes({&volume, 1})), "the volume is not taken");
  ViewScene scene;
  ViewVolume shown;
  shown.data = volume;
  shown.look = *preset_look("phantom");
  scene.volumes = {shown};
  std::array<Eye, 2> eyes;
  const glm::dvec3 middle =
      0.5 * (volume->frames.front()->low_m() + volume->frames.front()->high_m());
  split_eyes(eye_at(middle + glm::dvec3(0.1, 0.08, 0.28), middle, 0.5, size), 0.063, eyes[0],
             eyes[1]);

  test::HostImage colour(*context, size, VK_FORMAT_R8G8B8A8_SRGB, VK_IMAGE_ASPECT_COLOR_BIT,
                         VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
  test::HostImage depth(*context, size, VK_FORMAT_D32_SFLOAT, VK_IMAGE_ASPECT_DEPTH_BIT,
                        VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
  const std::vector<uint32_t> colours(colour.pixels(), 0xff201a1bu);
  // 1: the far end.
  const std::vector<uint32_t> depths(depth.pixels(), 0x3f800000u);
  HostImages images;
  images.colour_format = VK_FORMAT_R8G8B8A8_SRGB;
  images.depth_format = VK_FORMAT_D32_SFLOAT;
  for (uint32_t e = 0; e < 2; ++e) {
    colour.fill(e, colours);
    depth.fill(e, depths);
    images.eyes[e] = {colour.handle(), e, depth.handle(), e};
  }
  images.inverse_depth_0 = 1.0 / 0.02;
  images.inverse_depth_1 = 1.0 / 5.0;

  const auto draw = [&](const HostImages* into) {
    // A host draws its own picture each time; here only its background is restored.
    const auto begin = Clock::now();
    const Status started =
        into ? (*renderer)->start(scene, eyes, size, *into) : (*renderer)->start(scene, eyes, size);
    must(bool(started), started ? "" : started.error().message);
    must(bool((*renderer)->wait()), "the device failed");
    return 1e3 * seconds_of(begin);
  };
  std::vector<double> own_ms, host_ms, more;
  for (int k = 0; k < 3; ++k) draw(nullptr), draw(&images);
  for (int k = 0; k < 9; ++k) {
    for (uint32_t e = 0; e < 2; ++e) colour.fill(e, colours);
    own_ms.push_back(draw(nullptr));
    host_ms.push_back(draw(&images));
    more.push_back(host_ms.back() / own_ms.back() - 1.0);
  }
  int drawn = 0;
  for (const uint32_t pixel : colour.read(0)) drawn += pixel != colours.front();
  must(drawn > int(colours.size()) / 20, "the heart is not in the host's image");
  fmt::print(
      "picture   2 x {} x {}: own buffers {:.1f} ms, a host's images {:.1f} ms, {:+.1f} % (median "
      "of the ratios)\n",
      size.width, size.height, median(own_ms), median(host_ms), 100.0 * median(more));
}

}  // namespace
}  // namespace palpate

int main() {
  try {
    palpate::bench_tick();
    palpate::bench_view({320, 240});
    palpate::bench_view({640, 480});
  } catch (const std::exception& error) {
    fmt::print(stderr, "toolkit_bench: {}\n", error.what());
    return 1;
  }
}
