// What a request becomes: options of the loop, the device, and what is kept. The scene is the
// synthetic molecule, which needs no time, the device a simulated hand, so nothing waits for
// anything.
#include "integration/running/open_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "integration/running/session_options.h"
#include "tests/files/temporary_folder.h"

namespace palpate::running {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

SessionRequest with(std::initializer_list<std::pair<const char*, nlohmann::json>> options) {
  SessionRequest request;
  request.inputs = {"molecule"};
  request.device = "simulated";
  for (const auto& [key, value] : options) {
    const Status set = set_option(request, key, value);
    EXPECT_TRUE(set) << (set ? "" : set.error().message);
  }
  return request;
}

TEST(OpenSession, TakesTheOptionsOfTheLoop) {
  ConnectedSession connected;
  const auto prepared = prepare_session(with({{"max_force_n", 2.5},
                                              {"stiffness_n_per_m", 321.0},
                                              {"watchdog_s", 0.03},
                                              {"max_hand_speed_m_per_s", 0.7},
                                              {"tool_radius_mm", 2.5},
                                              {"tool_points", 4},
                                              {"dead_man", true},
                                              {"real_time", false},
                                              {"core", 1},
                                              {"tube_buttons", 5},
                                              {"preset", "best"}}),
                                        {}, {}, connected);
  ASSERT_TRUE(prepared) << prepared.error().message;
  const SafetyOptions& safety = prepared->options.haptics.safety;
  EXPECT_EQ(safety.max_force_n, 2.5);
  EXPECT_EQ(prepared->scene.spec.stiffness_n_per_m, 321.0);
  EXPECT_EQ(prepared->scene.spec.tool_points, 4);
  EXPECT_EQ(safety.late_s, 0.03);
  EXPECT_EQ(prepared->options.servo.loop.watchdog_ns, 30'000'000);
  EXPECT_EQ(safety.max_speed_m_per_s, 0.7);
  EXPECT_TRUE(safety.dead_man);
  EXPECT_EQ(prepared->options.servo.real_time.priority, 0);
  EXPECT_FALSE(prepared->options.servo.real_time.lock_memory);
  EXPECT_EQ(prepared->options.servo.real_time.core, 1);
  EXPECT_EQ(prepared->options.tube_buttons, 5U);
  EXPECT_EQ(prepared->options.motion.preset, "best");
  EXPECT_TRUE(prepared->felt.is_simulated);
  EXPECT_TRUE(connected.device);
}

TEST(OpenSession, HasTheUsualValuesWithoutOptions) {
  ConnectedSession connected;
  const auto prepared = prepare_session(with({}), {}, {}, connected);
  ASSERT_TRUE(prepared) << prepared.error().message;
  const SafetyOptions usual;
  const SafetyOptions& safety = prepared->options.haptics.safety;
  EXPECT_EQ(safety.max_force_n, prepared->scene.spec.max_force_n);
  EXPECT_EQ(safety.max_speed_m_per_s, usual.max_speed_m_per_s);
  EXPECT_EQ(safety.late_s, 0.05);  // a simulated hand can not be hurt
  EXPECT_FALSE(safety.dead_man);
  EXPECT_FALSE(prepared->options.motion.open_context);
}

TEST(OpenSession, LeavesAHostsDeviceToItsOwnWatchdog) {
  SessionHost host;
  host.ticks.emplace();
  host.ticks->workspace_radius_m = 0.1;
  host.ticks->max_force_n = 8.0;
  ConnectedSession connected;
  const auto prepared = prepare_session(with({}), std::move(host), {}, connected);
  ASSERT_TRUE(prepared) << prepared.error().message;
  EXPECT_TRUE(prepared->host_ticks);
  EXPECT_EQ(prepared->options.haptics.safety.late_s, 0.005);
  EXPECT_FALSE(connected.device);
}

TEST(OpenSession, EstimatesOnlyWhereItIsAskedTo) {
  SessionCallbacks callbacks;
  callbacks.open_context = []() -> Result<std::shared_ptr<vulkan::Context>> {
    return Error{ErrorKind::kNoDevice, "none"};
  };
  for (const bool estimate : {true, false}) {
    ConnectedSession connected;
    const auto prepared = prepare_session(with({{"estimate", estimate}}), {}, callbacks, connected);
    ASSERT_TRUE(prepared);
    EXPECT_EQ(bool(prepared->options.motion.open_context), estimate);
  }
}

TEST(OpenSession, LeavesMissingMotionOutOfARecording) {
  SessionRequest request = with({{"forget_motion", true}, {"record", "run.ticks"}});
  request.inputs = {"shell"};  // something with a motion
  ConnectedSession connected;
  const auto prepared = prepare_session(std::move(request), {}, {}, connected);
  ASSERT_TRUE(prepared) << prepared.error().message;
  EXPECT_TRUE(prepared->leaves_motion_out);
  EXPECT_TRUE(prepared->scene.missing.empty());
}

TEST(OpenSession, RefusesARecordingOfALiveSource) {
  SessionRequest request = with({{"record", "run.ticks"}});
  request.inputs = {"igtl://127.0.0.1:1"};
  ConnectedSession connected;
  const auto prepared = prepare_session(std::move(request), {}, {}, connected);
  ASSERT_FALSE(prepared);
  EXPECT_THAT(prepared.error().message, HasSubstr("is no part of a recording"));
}

TEST(OpenSession, RefusesHandsThatNobodyMoves) {
  for (const char* const hand : {"mouse", "controller"}) {
    ConnectedSession connected;
    const auto prepared = prepare_session(with({{"device", hand}}), {}, {}, connected);
    ASSERT_FALSE(prepared);
    EXPECT_THAT(prepared.error().message, HasSubstr("can be the hand only where"));
  }
}

TEST(OpenSession, TakesTheSceneFilesSection) {
  const files::TemporaryFolder folder;
  const auto scene = [&](const char* section) {
    std::ofstream(folder / "scene.json")
        << R"({"session": )" << section << R"(, "volumes": [{"name": "s", "source": "molecule"}],
               "modes": [{"volume": "s", "strength": 2}]})";
    SessionRequest request = with({{"watchdog_s", 0.02}});
    request.inputs = {folder / "scene.json"};
    return request;
  };
  ConnectedSession connected;
  const auto prepared = prepare_session(
      scene(R"({"watchdog_s": 0.5, "path": "tap", "dead_man": true})"), {}, {}, connected);
  ASSERT_TRUE(prepared) << prepared.error().message;
  EXPECT_EQ(prepared->options.haptics.safety.late_s, 0.02);  // the caller's
  EXPECT_TRUE(prepared->options.haptics.safety.dead_man);
  EXPECT_EQ(prepared->request.path, "tap");

  ConnectedSession other;
  const auto refused = prepare_session(scene(R"({"csv": "ticks.csv"})"), {}, {}, other);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, StartsWith("The scene's section session: csv can not"));
}

TEST(OpenSession, KeepsABlackBoxUnlessItIsOff) {
  const files::TemporaryFolder folder;
  for (const bool off : {false, true}) {
    ConnectedSession connected;
    const Status started = open_session(
        with({{"black_box", off ? "off" : (folder / "box").string()}, {"real_time", false}}), {},
        {}, connected);
    ASSERT_TRUE(started) << started.error().message;
    connected.stop();
    ASSERT_TRUE(connected.flight.finish());
    EXPECT_EQ(connected.flight.black_box() == nullptr, off);
  }
}

}  // namespace
}  // namespace palpate::running
