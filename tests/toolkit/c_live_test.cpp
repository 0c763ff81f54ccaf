// Inputs and outputs of a running session of the C library: frames that the host pushes, an
// OpenIGTLink server's frames, a tracked tool, what is served, a simulated hand, tables of ticks
// and recordings. The servers do not use the project's OpenIGTLink code (tests/openigtlink/wire.h).
// Oracle: a ball of known radius, whose surface must be felt there.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <optional>
#include <sstream>
#include <thread>

#include "integration/files/read_volume.h"
#include "integration/openigtlink/client.h"
#include "module/haptics/servo/monotonic.h"
#include "tests/files/temporary_folder.h"
#include "tests/openigtlink/wire.h"
#include "tests/support/wait_for.h"
#include "tests/toolkit/c_library.h"

namespace palpate::test {
namespace {

using namespace std::chrono_literals;
using files::TemporaryFolder;
using ::testing::HasSubstr;

/// A host's haptic loop on a thread of its own. Its hand moves along z to the place that the test
/// sets, at 10 mm/s at most. It starts outside and stays there for two seconds, until the start
/// ramp has ended, so that it meets the ball at its surface.
class HapticLoop {
 public:
  explicit HapticLoop(PalSession* session) {
    thread_ = std::jthread([this, session](std::stop_token stop) {
      auto next = std::chrono::steady_clock::now();
      double z_m = kOutside_m;
      int ticks = 0;
      while (!stop.stop_requested()) {
        if (++ticks > 2500) z_m += std::clamp(wanted_m - z_m, -1e-5, 1e-5);
        const PalTick tick{{0.0, 0.0, z_m}, monotonic_ns(), 0};
        double force_n[3];
        if (pal_haptics_tick(session, &tick, force_n) != PAL_OK) break;
        force_z_n = force_n[2];
        // After a pause missed ticks are not made up for: the hand would be too fast for a device.
        next = std::max(next + 1ms, std::chrono::steady_clock::now());
        std::this_thread::sleep_until(next);
      }
    });
  }
  static constexpr double kOutside_m = 0.03;
  std::atomic<double> wanted_m{kOutside_m}, force_z_n{0.0};

 private:
  std::jthread thread_;
};

/// The ball of `frame` alone.
struct OneBall : BallFrames {
  explicit OneBall(int frame) : BallFrames(frame + 1) {
    pointers = {samples[size_t(frame)].data()};
    info.frames = pointers.data();
    info.frame_count = 1;
  }
};

PalState state_of(PalSession* session) {
  PalState state{};
  state.size = sizeof state;
  PAL_EXPECT_OK(pal_session_state(session, &state));
  return state;
}

class CLive : public ::testing::Test {
 protected:
  /// A context with a device for computing; skips the test if there is none.
  void need_device() {
    const PalContextInfo info = context_info(0);
    const PalResult opened = pal_context_open(&info, &opened_.context);
    if (opened == PAL_NO_DEVICE) GTEST_SKIP() << pal_last_error();
    PAL_ASSERT_OK(opened);
  }
  void no_device() {
    const PalContextInfo info = context_info();
    PAL_ASSERT_OK(pal_context_open(&info, &opened_.context));
  }
  void open_scene(const char* path, uint32_t flags = 0, const PalFrames* frames = nullptr) {
    const PalSceneInfo scene = scene_info(&path, flags, frames);
    PAL_ASSERT_OK(pal_scene_open(opened_.context, &scene, &opened_.scene));
  }
  static PalSessionInfo host_ticks(uint32_t flags = 0) {
    static const PalDeviceInfo kDevice = host_device();
    PalSessionInfo info{};
    info.size = sizeof info;
    info.flags = PAL_SESSION_HOST_TICKS | flags;
    info.host = &kDevice;
    // Long, because other tests run at the same time.
    info.watchdog_s = 0.5;
    return info;
  }
  void open_session(PalSessionInfo info) {
    info.user = this;
    info.on_event = [](void* user, PalEventKind, const char* sentence) {
      auto* const self = static_cast<CLive*>(user);
      const std::lock_guard lock(self->mutex_);
      self->events_ += std::string(sentence) + "\n";
    };
    PAL_ASSERT_OK(pal_session_open(opened_.scene, &info, &opened_.session));
  }
  std::string events() {
    const std::lock_guard lock(mutex_);
    return events_;
  }
  uint64_t felt() { return state_of(opened_.session).frames_felt; }

  std::mutex mutex_;  ///< of events_; both outlive the session
  std::string events_;
  Opened opened_;
};

/// The hand presses 2 mm deep, and then leaves the ball.
void expect_surface_at(double radius_m, HapticLoop& loop, PalSession* session) {
  loop.wanted_m = radius_m - 0.002;
  EXPECT_TRUE(wait_for([&] {
    const PalState state = state_of(session);
    return state.in_contact && std::abs(state.hand_m[2] - loop.wanted_m) < 1e-6;
  })) << radius_m;
  EXPECT_TRUE(wait_for([&] {
    const PalState state = state_of(session);
    return std::abs(state.proxy_m[2] - radius_m) < 0.6e-3 &&
           std::abs(loop.force_z_n - 600.0 * (state.proxy_m[2] - state.hand_m[2])) < 0.05;
  })) << "the proxy is at "
      << state_of(session).proxy_m[2] << " m instead of " << radius_m << ", the force is "
      << loop.force_z_n << " N";
  loop.wanted_m = HapticLoop::kOutside_m;
  EXPECT_TRUE(wait_for(
      [&] { return std::abs(state_of(session).hand_m[2] - HapticLoop::kOutside_m) < 1e-6; }));
}

TEST_F(CLive, CarriesTheHandToFramesThatTheHostPushes) {
  need_device();
  const OneBall first(0);
  open_scene("ball", PAL_SCENE_LIVE, &first.info);
  open_session(host_ticks(PAL_SESSION_FOLLOW));
  HapticLoop loop(opened_.session);
  expect_surface_at(0.020, loop, opened_.session);
  for (const int frame : {1, 2}) {
    const OneBall next(frame);
    PAL_ASSERT_OK(pal_session_push_frame(opened_.session, nullptr, PAL_FLOAT32, next.pointers[0],
                                         monotonic_ns()));
    ASSERT_TRUE(wait_for([&] { return felt() == uint64_t(frame); })) << events();
    expect_surface_at(0.020 + 0.0015 * frame, loop, opened_.session);
  }
  const PalState state = state_of(opened_.session);
  EXPECT_EQ(state.frames_received, 2U);
  EXPECT_GT(state.frame_delay_s, 0.0);
  EXPECT_EQ(state.frame_cycle_s, 0.0);
  // A frame at another place is left out, and this is an event.
  const OneBall next(1);
  PalGrid far = next.info.grid;
  far.origin_mm[0] += 1000.0;
  PAL_EXPECT_OK(pal_session_push_frame(opened_.session, &far, PAL_FLOAT32, next.pointers[0], 0));
  EXPECT_TRUE(wait_for([&] { return events().find("lies elsewhere") != std::string::npos; }));
  PAL_EXPECT_OK(pal_session_stop(opened_.session));
  EXPECT_EQ(state_of(opened_.session).frames_received, 3U);
  EXPECT_EQ(pal_session_push_frame(opened_.session, nullptr, PAL_FLOAT32, next.pointers[0], 0),
            PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("was stopped"));
}

TEST_F(CLive, FeelsABeatingHeartAsItsFramesArrive) {
  const std::filesystem::path cine = std::filesystem::path(PALPATE_SHARED_DATA) / "heart_cine";
  if (!std::filesystem::exists(cine / "frame_00.mha")) GTEST_SKIP() << "There is no heart_cine.";
  need_device();
  if (IsSkipped()) return;
  std::vector<Volume> frames;
  for (int k = 0; k < 20; ++k) {
    const std::string name = (k < 10 ? "frame_0" : "frame_") + std::to_string(k) + ".mha";
    if (!std::filesystem::exists(cine / name)) break;
    auto frame = files::read_volume(cine / name);
    ASSERT_TRUE(frame) << frame.error().message;
    frames.push_back(std::move(*frame));
  }
  ASSERT_GT(frames.size(), 5U);
  PalFrames given{};
  given.size = sizeof given;
  given.name = "heart";
  const Grid& grid = frames[0].grid;
  for (int a = 0; a < 3; ++a) {
    given.grid.size[a] = uint32_t(grid.size[a]);
    given.grid.spacing_mm[a] = grid.spacing_mm[a];
    given.grid.origin_mm[a] = grid.origin_mm[a];
    for (int row = 0; row < 3; ++row) given.grid.direction[3 * row + a] = grid.direction[a][row];
  }
  const void* const first = frames[0].values.data();
  given.frames = &first;
  given.frame_count = 1;
  open_scene("heart", PAL_SCENE_LIVE, &given);
  // During this a simulated hand presses.
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_NO_REAL_TIME | PAL_SESSION_FOLLOW;
  info.device_name = "simulated";
  open_session(info);
  double most_n = 0.0;
  size_t pushed = 0;
  const auto push = [&] {
    ++pushed;
    PAL_EXPECT_OK(pal_session_push_frame(opened_.session, nullptr, PAL_FLOAT32,
                                         frames[pushed % frames.size()].values.data(), 0));
    for (int n = 0; n < 10; ++n) {
      std::this_thread::sleep_for(10ms);
      const PalState state = state_of(opened_.session);
      most_n = std::max(most_n, std::hypot(state.force_n[0], state.force_n[1], state.force_n[2]));
    }
  };
  while (pushed < 59) push();
  // On a busy machine most frames are left out for newer ones: they come until enough are felt.
  EXPECT_TRUE(wait_for([&] {
    if (felt() < 3) push();
    return felt() >= 3;
  })) << events();
  const PalState state = state_of(opened_.session);
  EXPECT_EQ(state.frames_received, pushed);
  EXPECT_GT(most_n, 0.3);
  EXPECT_LT(most_n, 6.0);
}

TEST_F(CLive, RefusesFramesAndScenesThatCanNotBeLive) {
  need_device();
  if (IsSkipped()) return;
  const OneBall first(0);
  open_scene("ball", PAL_SCENE_LIVE, &first.info);
  const auto refusal = [&](PalResult result) {
    EXPECT_LT(result, PAL_OK);
    return std::string(pal_last_error());
  };
  PalSession* never = nullptr;
  PalSessionInfo info = host_ticks(PAL_SESSION_NO_ESTIMATION);
  EXPECT_EQ(pal_session_open(opened_.scene, &info, &never), PAL_NO_DEVICE);
  info = host_ticks();
  info.recording = "/tmp/never.ticks";
  EXPECT_THAT(refusal(pal_session_open(opened_.scene, &info, &never)), HasSubstr("no part of a"));
  open_session(host_ticks());
  const void* const samples = first.pointers[0];
  const auto push = [&](const PalGrid* grid, PalSampleType type, const void* of, int64_t time_ns) {
    return pal_session_push_frame(opened_.session, grid, type, of, time_ns);
  };
  EXPECT_THAT(refusal(push(nullptr, PAL_FLOAT32, nullptr, 0)), HasSubstr("no samples"));
  EXPECT_THAT(refusal(push(nullptr, PalSampleType(99), samples, 0)), HasSubstr("sample type"));
  EXPECT_THAT(refusal(push(nullptr, PAL_FLOAT32, samples, monotonic_ns() + 1'000'000'000)),
              HasSubstr("not in the future"));
  PalGrid grid = first.info.grid;
  grid.spacing_mm[2] = 0.0;
  EXPECT_THAT(refusal(push(&grid, PAL_FLOAT32, samples, 0)),
              HasSubstr("can not be: it needs samples"));
  std::vector<float> bad = first.samples[0];
  bad[5] = std::nanf("");
  EXPECT_THAT(refusal(push(nullptr, PAL_FLOAT32, bad.data(), 0)), HasSubstr("not finite"));

  Opened still;
  open_ball(still, BallFrames());
  EXPECT_THAT(refusal(pal_session_push_frame(still.session, nullptr, PAL_FLOAT32, samples, 0)),
              HasSubstr("PAL_SCENE_LIVE"));

  const BallFrames three(3);
  const char* path = "ball";
  const PalSceneInfo scene = scene_info(&path, PAL_SCENE_LIVE, &three.info);
  PalScene* none = nullptr;
  EXPECT_THAT(refusal(pal_scene_open(opened_.context, &scene, &none)), HasSubstr("one frame"));
  path = "heart";
  EXPECT_THAT(refusal(pal_scene_open(opened_.context, &scene, &none)), HasSubstr("PalFrames"));
}

TEST_F(CLive, NeedsADeviceThatComputesToFollowFrames) {
  no_device();
  const OneBall first(0);
  open_scene("ball", PAL_SCENE_LIVE, &first.info);
  const PalSessionInfo info = host_ticks();
  EXPECT_EQ(pal_session_open(opened_.scene, &info, &opened_.session), PAL_NO_DEVICE);
  EXPECT_THAT(pal_last_error(), HasSubstr("estimating their motion"));
}

/// The ball of a frame as an OpenIGTLink IMAGE (whose matrix has the position of its middle, RAS).
Raw ball_message(int frame, uint32_t seconds) {
  const OneBall ball(frame);
  WireImage image;
  image.scalar_type = 10;  // float32
  image.size = image.part = {32, 32, 32};
  image.matrix = {2, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0};
  const auto* const bytes = static_cast<const uint8_t*>(ball.pointers[0]);
  image.samples.assign(bytes, bytes + sizeof(float) * ball.samples[0].size());
  WireHeader header;
  header.seconds = seconds;
  return wire_message(header, image.body());
}

/// A TRANSFORM that shifts by these distances, RAS.
Raw transform_message(const std::string& device, float x_mm, float y_mm, float z_mm,
                      uint32_t seconds) {
  Raw body;
  for (const float f : {1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, x_mm, y_mm, z_mm})
    put_float(body, f);
  WireHeader header;
  header.type = "TRANSFORM";
  header.device = device;
  header.seconds = seconds;
  return wire_message(header, body);
}

/// A scanner: sends the frame that the test sets to the connected client, ten times per second.
class Scanner {
 public:
  Scanner() {
    thread_ = std::jthread([this](std::stop_token stop) {
      while (!stop.stop_requested()) {
        if (!server_.accept_one(50)) continue;
        bool there = true;
        while (there && !stop.stop_requested()) {
          there = server_.send(ball_message(frame, ++seconds_)) &&
                  server_.send(transform_message("Table", float(right_mm), 0.F, 0.F, seconds_));
          std::this_thread::sleep_for(100ms);
        }
      }
    });
  }
  std::string place() const { return "igtl://127.0.0.1:" + std::to_string(server_.port()); }
  std::atomic<int> frame{0};
  std::atomic<double> right_mm{0.0};

 private:
  WireServer server_;
  uint32_t seconds_ = 100;
  std::jthread thread_;
};

TEST_F(CLive, FollowsAnOpenIGTLinkServersImages) {
  need_device();
  if (IsSkipped()) return;
  Scanner scanner;
  open_scene(scanner.place().c_str());
  PalVolume volume{};
  volume.size = sizeof volume;
  PAL_ASSERT_OK(pal_scene_volume(opened_.scene, 0, &volume));
  EXPECT_NEAR(volume.high_m[0], 0.032, 0.0011);
  open_session(host_ticks(PAL_SESSION_FOLLOW));
  HapticLoop loop(opened_.session);
  expect_surface_at(0.020, loop, opened_.session);
  scanner.frame = 2;
  // The same bytes again are no new frame. So there is one new frame, for which there may be two
  // events.
  ASSERT_TRUE(wait_for([&] { return felt() >= 1; })) << events();
  expect_surface_at(0.023, loop, opened_.session);
  EXPECT_THAT(events(), HasSubstr("is connected"));
  EXPECT_GE(state_of(opened_.session).frames_received, 1U);
  EXPECT_EQ(
      pal_session_push_frame(opened_.session, nullptr, PAL_FLOAT32, OneBall(0).pointers[0], 0),
      PAL_BAD_INPUT);
  PAL_EXPECT_OK(pal_session_close(&opened_.session));
}

TEST_F(CLive, MovesTheVolumeByAServersTransforms) {
  need_device();
  if (IsSkipped()) return;
  Scanner scanner;
  const std::string place = scanner.place();
  const char* path = place.c_str();
  PalSceneInfo scene = scene_info(&path);
  scene.transform = "Table";
  PAL_ASSERT_OK(pal_scene_open(opened_.context, &scene, &opened_.scene));
  open_session(host_ticks());
  const HapticLoop loop(opened_.session);
  std::this_thread::sleep_for(500ms);
  // To the patient's right, which is -x of the world.
  scanner.right_mm = 10.0;
  PalVolumeState volume{};
  volume.size = sizeof volume;
  EXPECT_TRUE(wait_for([&] {
    return pal_session_volume(opened_.session, 0, &volume) == PAL_OK &&
           std::abs(volume.world_from_volume[3] + 0.010) < 1e-5;
  })) << volume.world_from_volume[3];
}

TEST_F(CLive, WaitsForAServerNoLongerThanIsSaid) {
  no_device();
  const WireServer silent;
  const std::string place = "igtl://127.0.0.1:" + std::to_string(silent.port());
  const char* path = place.c_str();
  PalSceneInfo scene = scene_info(&path);
  scene.wait_s = 0.3;
  EXPECT_EQ(pal_scene_open(opened_.context, &scene, &opened_.scene), PAL_NO_DEVICE);
  EXPECT_THAT(pal_last_error(), HasSubstr("within 0.3 s"));
  path = "igtl://";
  EXPECT_EQ(pal_scene_open(opened_.context, &scene, &opened_.scene), PAL_BAD_INPUT);
}

TEST_F(CLive, ServesWhereTheProxyIsAndTheVolume) {
  no_device();
  const BallFrames ball;
  open_scene("ball", 0, &ball.info);
  PalSessionInfo info = host_ticks();
  const uint16_t port = WireServer().port();
  info.serve_port = port;
  open_session(info);
  PalSession* other = nullptr;
  EXPECT_EQ(pal_session_open(opened_.scene, &info, &other), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("can not be had"));
  info.serve_port = 65536;
  EXPECT_EQ(pal_session_open(opened_.scene, &info, &other), PAL_BAD_INPUT);

  std::mutex mutex;
  std::optional<openigtlink::Rigid> proxy;
  std::optional<Volume> volume;
  openigtlink::ClientOptions options;
  options.image = "palpate_volume";
  options.transform = "palpate_proxy";
  options.on_image = [&](openigtlink::ArrivedImage image) {
    const std::lock_guard lock(mutex);
    volume = std::move(image.volume);
  };
  options.on_transform = [&](const openigtlink::Rigid& rigid) {
    const std::lock_guard lock(mutex);
    proxy = rigid;
  };
  const auto client = openigtlink::Client::start({"127.0.0.1", port}, std::move(options));
  ASSERT_TRUE(client);
  HapticLoop loop(opened_.session);
  loop.wanted_m = 0.0185;
  EXPECT_TRUE(
      wait_for([&] { return std::abs(state_of(opened_.session).hand_m[2] - 0.0185) < 1e-6; }));
  // Values sent on the way there do not count.
  std::this_thread::sleep_for(300ms);
  {
    const std::lock_guard lock(mutex);
    proxy.reset();
  }
  EXPECT_TRUE(wait_for([&] {
    const std::lock_guard lock(mutex);
    return proxy && volume;
  }));
  const std::lock_guard lock(mutex);
  ASSERT_TRUE(proxy && volume);
  // z towards the user is -P: the proxy stays on the ball's surface.
  EXPECT_NEAR(proxy->translation_mm.y, -20.0, 0.6);
  EXPECT_NEAR(proxy->translation_mm.x, 0.0, 0.2);
  EXPECT_NEAR(proxy->translation_mm.z, 0.0, 0.2);
  EXPECT_NEAR(*std::max_element(volume->values.begin(), volume->values.end()), 1000.0F, 20.0F);
}

TEST_F(CLive, IsHeldByATrackedTool) {
  no_device();
  const BallFrames ball;
  open_scene("ball", 0, &ball.info);
  WireServer tracker;
  std::atomic<float> x_mm{5.F};
  const std::jthread sending([&](std::stop_token stop) {
    uint32_t seconds = 100;
    while (!stop.stop_requested()) {
      if (!tracker.accept_one(50)) continue;
      while (!stop.stop_requested() &&
             tracker.send(transform_message("Other", 90.F, 0.F, 0.F, ++seconds)) &&
             tracker.send(transform_message("Needle", x_mm, -40.F, 7.F, seconds)))
        std::this_thread::sleep_for(30ms);
    }
  });
  const std::string place = "igtl://127.0.0.1:" + std::to_string(tracker.port());
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_NO_REAL_TIME;
  info.device_name = place.c_str();
  info.tool = "Needle";
  open_session(info);
  // RAS in the message: x_mm to the right is -L, which is -x; y = -40 is P 40, which is z = -40 mm.
  const auto is_at = [&](double x_m) {
    return wait_for([&] {
      const PalState state = state_of(opened_.session);
      return std::hypot(state.hand_m[0] - x_m, state.hand_m[1] - 0.007, state.hand_m[2] + 0.040) <
             1e-4;
    });
  };
  EXPECT_TRUE(is_at(-0.005));
  x_mm = -12.F;
  EXPECT_TRUE(is_at(0.012));
}

TEST_F(CLive, IsPressedByASimulatedHandTabledRecordedAndReplayed) {
  no_device();
  const TemporaryFolder folder;
  const std::string table = folder / "ticks.csv", recording = folder / "ticks.bin",
                    tubes = folder / "tubes.vtk";
  open_scene("shell");
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_NO_REAL_TIME;
  info.device_name = "simulated";
  info.simulated_path = "sideways";
  EXPECT_EQ(pal_session_open(opened_.scene, &info, &opened_.session), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("sideways"));
  info.simulated_path = "tap";
  info.simulated_hand = "strong";
  EXPECT_EQ(pal_session_open(opened_.scene, &info, &opened_.session), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("'strong'"));
  info.simulated_hand = "firm";
  info.csv = "/nowhere/ticks.csv";
  EXPECT_EQ(pal_session_open(opened_.scene, &info, &opened_.session), PAL_BAD_OUTPUT);
  info.csv = table.c_str();
  info.recording = recording.c_str();
  open_session(info);
  double most_n = 0.0;
  EXPECT_TRUE(wait_for([&] {
    const PalState state = state_of(opened_.session);
    most_n = std::max(most_n, std::hypot(state.force_n[0], state.force_n[1], state.force_n[2]));
    return most_n > 0.5;
  }));
  PAL_ASSERT_OK(pal_session_ask_tubes(opened_.session, PAL_TUBES_RELEASE));
  PalTube tube{};
  tube.size = sizeof tube;
  EXPECT_TRUE(wait_for([&] { return pal_session_tube(opened_.session, 0, &tube) == PAL_OK; }));
  PAL_ASSERT_OK(pal_session_stop(opened_.session));
  const uint64_t ticks = state_of(opened_.session).ticks;
  PAL_ASSERT_OK(pal_session_close(&opened_.session));

  std::ifstream rows(table);
  std::string line;
  std::getline(rows, line);
  EXPECT_TRUE(line.starts_with("t_s,dt_s,force_x_n")) << line;
  uint64_t count = 0;
  double most_row_n = 0.0;
  while (std::getline(rows, line)) {
    ++count;
    std::istringstream cells(line);
    std::vector<double> numbers;
    for (std::string cell; numbers.size() < 5 && std::getline(cells, cell, ',');)
      numbers.push_back(std::stod(cell));
    ASSERT_EQ(numbers.size(), 5U) << line;
    most_row_n = std::max(most_row_n, std::hypot(numbers[2], numbers[3], numbers[4]));
  }
  EXPECT_EQ(count, ticks);
  EXPECT_GE(most_row_n, most_n - 1e-4);

  PalReplay replay{};
  replay.size = sizeof replay;
  PAL_ASSERT_OK(pal_scene_replay(opened_.scene, recording.c_str(), tubes.c_str(), &replay));
  EXPECT_EQ(replay.ticks, ticks);
  EXPECT_EQ(replay.different, 0U);
  EXPECT_LT(replay.first_different, 0);
  EXPECT_EQ(replay.is_cut_off, 0U);
  EXPECT_THAT(files::read_bytes(tubes), HasSubstr("LINES 1 "));
  EXPECT_EQ(pal_scene_replay(opened_.scene, table.c_str(), nullptr, &replay), PAL_BAD_INPUT);
  PAL_ASSERT_OK(pal_scene_close(&opened_.scene));
  open_scene("heart");
  EXPECT_EQ(pal_scene_replay(opened_.scene, recording.c_str(), nullptr, &replay), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("another scene"));
}

TEST_F(CLive, TellsOfTicksThatATableLacks) {
  no_device();
  const TemporaryFolder folder;
  const std::string table = folder / "ticks.csv";
  const BallFrames ball;
  open_scene("ball", 0, &ball.info);
  // A table whose reader does not read yet: ticks that its writer can not pass on are lost.
  ASSERT_EQ(mkfifo(table.c_str(), 0600), 0);
  const int reader = open(table.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(reader, 0);
  PalSessionInfo info = host_ticks();
  info.csv = table.c_str();
  open_session(info);
  HostHand hand{opened_.session};
  for (int k = 0; k < 10'000; ++k) hand.at(0.03);
  std::jthread reading([reader](std::stop_token stop) {
    std::array<char, 65536> rows;
    while (!stop.stop_requested())
      if (read(reader, rows.data(), rows.size()) <= 0) std::this_thread::sleep_for(1ms);
  });
  EXPECT_EQ(pal_session_close(&opened_.session), PAL_BAD_OUTPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("ticks are missing"));
  reading = {};
  close(reader);
}

TEST_F(CLive, WritesTheTicksAroundAFaultIntoABlackBox) {
  no_device();
  const TemporaryFolder folder;
  const std::string box = folder / "box";
  const BallFrames ball;
  open_scene("ball", 0, &ball.info);
  struct Arm {
    std::atomic<bool> is_gone{false};
    std::atomic<int> exchanges{0};
  } arm;
  const PalDeviceInfo about = host_device();
  PalDevice device = device_of(about, &arm, [](void* user, const double*, PalReading* reading) {
    Arm& of = *static_cast<Arm*>(user);
    ++of.exchanges;
    reading->position_m[2] = 0.04;
    reading->is_fresh = 1;
    reading->fault = of.is_gone ? PAL_FAULT_UNPLUGGED : PAL_FAULT_NONE;
  });
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_NO_REAL_TIME;
  info.device = &device;
  // Long, because other tests run at the same time: the intended fault must be the only one.
  info.watchdog_s = 0.5;
  info.black_box = box.c_str();
  open_session(info);
  ASSERT_TRUE(wait_for([&] { return arm.exchanges > 500; }));
  EXPECT_FALSE(std::filesystem::exists(box));
  arm.is_gone = true;
  const auto files = [&] {
    std::vector<std::filesystem::path> found;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(box, none))
      found.push_back(entry.path());
    return found;
  };
  EXPECT_TRUE(wait_for([&] { return files().size() == 1; }));
  PAL_ASSERT_OK(pal_session_close(&opened_.session));
  ASSERT_EQ(files().size(), 1U);
  EXPECT_GT(std::filesystem::file_size(files()[0]), 1000U);

  // A folder that can no longer be made when the fault happens.
  const std::string taken = folder / "taken";
  info.black_box = taken.c_str();
  arm.is_gone = false;
  arm.exchanges = 0;
  open_session(info);
  ASSERT_TRUE(wait_for([&] { return arm.exchanges > 500; }));
  std::ofstream(taken) << "a file";
  arm.is_gone = true;
  arm.exchanges = 0;
  ASSERT_TRUE(wait_for([&] { return arm.exchanges > 300; }));
  EXPECT_EQ(pal_session_close(&opened_.session), PAL_BAD_OUTPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("The last ticks could not be written"));
}

TEST_F(CLive, TakesTheWordsOfASequenceWithoutAScene) {
  no_device();
  const TemporaryFolder folder;
  // A segmentation of a smaller ball, of 12 mm radius, around the same middle.
  const std::string labels = folder / "labels.mha";
  {
    std::ofstream file(labels, std::ios::binary);
    file << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
            "Offset = -31 -31 -31\nElementSpacing = 2 2 2\nDimSize = 32 32 32\n"
            "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    for (int k = 0; k < 32; ++k)
      for (int j = 0; j < 32; ++j)
        for (int i = 0; i < 32; ++i)
          file.put(2.0 * std::hypot(i - 15.5, j - 15.5, k - 15.5) < 12.0 ? '\1' : '\0');
  }
  const BallFrames ball;
  const char* path = "ball";
  const char* segments = labels.c_str();
  PalSceneInfo scene = scene_info(&path, 0, &ball.info);
  const auto refusal = [&] {
    EXPECT_EQ(pal_scene_open(opened_.context, &scene, &opened_.scene), PAL_BAD_INPUT);
    return std::string(pal_last_error());
  };
  scene.wall = "brick";
  EXPECT_THAT(refusal(), HasSubstr("'brick'"));
  scene.wall = "values";
  scene.values = "all";
  EXPECT_THAT(refusal(), HasSubstr("'all'"));
  scene.values = nullptr;
  scene.scale = -1.0;
  EXPECT_THAT(refusal(), HasSubstr("scale"));
  scene.scale = 0.0;
  scene.segments = &segments;
  scene.segmentation_count = 1;
  EXPECT_THAT(refusal(), HasSubstr("segments or a wall"));
  scene.wall = nullptr;
  const char* none = nullptr;
  scene.segment_names = &none;
  scene.segment_count = 1;
  EXPECT_THAT(refusal(), HasSubstr("segment is missing"));
  scene.segment_names = nullptr;
  scene.segment_count = 0;
  // The part is felt, at twice its size, instead of the values' ball of 20 mm.
  scene.scale = 2.0;
  PAL_ASSERT_OK(pal_scene_open(opened_.context, &scene, &opened_.scene));
  open_session(host_ticks());
  HostHand hand{opened_.session};
  const double twice_m = hand.press(1.0) + 1.0 / 600.0;
  PAL_ASSERT_OK(pal_session_close(&opened_.session));
  PAL_ASSERT_OK(pal_scene_close(&opened_.scene));
  scene.scale = 0.0;
  PAL_ASSERT_OK(pal_scene_open(opened_.context, &scene, &opened_.scene));
  open_session(host_ticks());
  HostHand second{opened_.session};
  const double once_m = second.press(1.0) + 1.0 / 600.0;
  // 12 mm, with the error of labels of 2 mm: the corners of their voxels are smoothed.
  EXPECT_NEAR(once_m, 0.012, 0.0015);
  EXPECT_NEAR(twice_m, 2.0 * once_m, 0.0005);
  PAL_ASSERT_OK(pal_session_close(&opened_.session));
  PAL_ASSERT_OK(pal_scene_close(&opened_.scene));

  // Frames without motion between them, on purpose: no motion is missing.
  const BallFrames three(3);
  scene = scene_info(&path, PAL_SCENE_NO_MOTION, &three.info);
  scene.wall = "values";
  scene.values = "own";
  PAL_ASSERT_OK(pal_scene_open(opened_.context, &scene, &opened_.scene));
  PalVolume volume{};
  volume.size = sizeof volume;
  PAL_ASSERT_OK(pal_scene_volume(opened_.scene, 0, &volume));
  EXPECT_EQ(volume.is_motion_known, 1U);
}

TEST_F(CLive, EstimatesThePhantomsThatAreToldToForgetTheirMotion) {
  no_device();
  PalVolume volume{};
  volume.size = sizeof volume;
  const auto knows = [&](uint32_t flags) {
    open_scene("shell", flags);
    PAL_EXPECT_OK(pal_scene_volume(opened_.scene, 0, &volume));
    PAL_EXPECT_OK(pal_scene_close(&opened_.scene));
    return volume.is_motion_known;
  };
  EXPECT_EQ(knows(PAL_SCENE_FORGET_MOTION), 0U);
  EXPECT_EQ(knows(PAL_SCENE_FORGET_MOTION | PAL_SCENE_NO_MOTION), 1U) << "nothing is missing";
}

}  // namespace
}  // namespace palpate::test
