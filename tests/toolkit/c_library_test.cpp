// Correct and incorrect use of the C library by a host.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <thread>

#include "tests/devices/fake_dhd.h"
#include "tests/files/temporary_folder.h"
#include "tests/haptics/forbidden_calls.h"
#include "tests/toolkit/c_header.h"
#include "tests/toolkit/c_library.h"

namespace palpate::test {
namespace {

using ::testing::HasSubstr;

std::string text_of(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(PALPATE_SOURCE_DIR "/" + file).rdbuf();
  return text.str();
}

/// The first group of each match.
std::set<std::string> matches(const std::string& text, const char* expression) {
  const std::regex searched(expression);
  std::set<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), searched), end; at != end; ++at)
    found.insert((*at)[1]);
  return found;
}

TEST(CHeader, HasTheSameStructuresInCAndCpp) {
#define SIZE(name) {#name, sizeof(name)},
  const std::map<std::string, size_t> in_cpp{C_STRUCTURES(SIZE)};
#undef SIZE
  std::map<std::string, size_t> in_c;
  for (const CStructure* one = kCStructures; one->name; ++one) in_c[one->name] = one->size;
  EXPECT_EQ(in_c, in_cpp);
  // The list must contain all structures that the headers define.
  std::set<std::string> listed;
  for (const auto& [name, size] : in_c) listed.insert(name);
  EXPECT_EQ(listed, matches(text_of("integration/toolkit/palpate.h") +
                                text_of("integration/loading/palpate_mode.h"),
                            "struct (Pal\\w+) \\{"));
}

TEST(CLibrary, ExportsWhatItsHeaderAndItsListNameAndNothingElse) {
  const auto named =
      matches(text_of("integration/toolkit/palpate.h"), "PAL_API[^;(]*?(pal_\\w+)\\(");
  const auto listed = matches(text_of("integration/toolkit/palpate.map"), "(\\w+);");
  std::FILE* const nm = ::popen("nm -D --defined-only " PALPATE_LIBRARY, "r");
  ASSERT_TRUE(nm);
  std::string symbols;
  char line[512];
  while (std::fgets(line, sizeof line, nm)) symbols += line;
  EXPECT_EQ(::pclose(nm), 0);
  auto exported = matches(symbols, " (\\w+)(?:@\\S*)?\n");
  // The name of the version node itself.
  exported.erase("PALPATE_0");
  EXPECT_EQ(named, listed);
  EXPECT_EQ(exported, listed);
  EXPECT_GT(listed.size(), 20U);
}

TEST(CLibrary, RefusesStructuresThatItDoesNotKnow) {
  PalContext* context = nullptr;
  PalContextInfo info = context_info();
  for (const uint32_t size : {0U, 4U, uint32_t(sizeof info) + 8}) {
    info.size = size;
    EXPECT_EQ(pal_context_open(&info, &context), PAL_BAD_VERSION) << size;
    EXPECT_EQ(context, nullptr);
    EXPECT_THAT(pal_last_error(), HasSubstr("PalContextInfo"));
  }
  EXPECT_EQ(pal_context_open(nullptr, &context), PAL_BAD_INPUT);
  EXPECT_EQ(pal_context_open(&info, nullptr), PAL_BAD_INPUT);
  info = context_info();
  info.version = PAL_VERSION + (1U << 16);
  EXPECT_EQ(pal_context_open(&info, &context), PAL_BAD_VERSION);
  info.version = 0xffffff;
  EXPECT_EQ(pal_context_open(&info, &context), PAL_BAD_VERSION);
}

TEST(CLibrary, RefusesNestedStructuresThatItDoesNotKnowInTheSameWay) {
  const auto refused = [](PalResult result, const char* name, uint32_t size) {
    EXPECT_EQ(result, PAL_BAD_VERSION) << name << " of " << size << " bytes: " << pal_last_error();
    EXPECT_THAT(pal_last_error(), HasSubstr(std::string(name) + " "));
  };
  Opened opened;
  open_ball(opened, BallFrames());
  for (const uint32_t more : {0U, 8U}) {
    const auto wrong = [&](size_t size) { return more ? uint32_t(size) + more : 4U; };

    PalVulkan vulkan{};
    vulkan.size = wrong(sizeof vulkan);
    PalContextInfo of_context = context_info(0);
    of_context.vulkan = &vulkan;
    PalContext* context = nullptr;
    refused(pal_context_open(&of_context, &context), "PalVulkan", vulkan.size);

    BallFrames ball;
    ball.info.size = wrong(sizeof ball.info);
    const char* path = "ball";
    PalSceneInfo of_scene = scene_info(&path, 0, &ball.info);
    PalScene* scene = nullptr;
    refused(pal_scene_open(opened.context, &of_scene, &scene), "PalFrames", ball.info.size);

    PalDeviceInfo about = host_device();
    about.size = wrong(sizeof about);
    PalSessionInfo of_session{};
    of_session.size = sizeof of_session;
    of_session.flags = PAL_SESSION_HOST_TICKS;
    of_session.host = &about;
    PalSession* session = nullptr;
    refused(pal_session_open(opened.scene, &of_session, &session), "PalDeviceInfo", about.size);

    PalDevice device = device_of(about, nullptr, [](void*, const double*, PalReading*) {});
    of_session.flags = PAL_SESSION_NO_REAL_TIME;
    of_session.host = nullptr;
    of_session.device = &device;
    refused(pal_session_open(opened.scene, &of_session, &session), "PalDeviceInfo", about.size);
    device.size = wrong(sizeof device);
    refused(pal_session_open(opened.scene, &of_session, &session), "PalDevice", device.size);
    EXPECT_EQ(session, nullptr);
  }
}

TEST(CLibrary, TakesTheShorterStructuresOfOlderPrograms) {
  // An older program's structure ends at `device`; there is no memory behind it.
  std::vector<unsigned char> bytes(offsetof(PalContextInfo, device));
  PalContextInfo info = context_info();
  info.size = uint32_t(bytes.size());
  std::memcpy(bytes.data(), &info, bytes.size());
  PalContext* context = nullptr;
  PAL_EXPECT_OK(pal_context_open(reinterpret_cast<const PalContextInfo*>(bytes.data()), &context));
  EXPECT_STREQ(pal_context_device(context), "");
  PAL_EXPECT_OK(pal_context_close(&context));
  EXPECT_EQ(context, nullptr);

  Opened opened;
  open_ball(opened, BallFrames());
  std::vector<unsigned char> state(offsetof(PalState, cause) + 16, 0xee);
  const uint32_t short_size = offsetof(PalState, cause);
  std::memcpy(state.data(), &short_size, 4);
  PAL_EXPECT_OK(pal_session_state(opened.session, reinterpret_cast<PalState*>(state.data())));
  for (size_t k = short_size; k < state.size(); ++k) EXPECT_EQ(state[k], 0xee) << "byte " << k;

  // The structure that describes a device may also be shorter than the library's, inside another
  // structure too.
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  PalDeviceInfo about = host_device();
  about.size = offsetof(PalDeviceInfo, resolution_m);
  about.resolution_m = about.delay_s = std::nan("");  // not read
  PalDevice device = device_of(about, nullptr, [](void*, const double*, PalReading*) {});
  PalSessionInfo of_session{};
  of_session.size = sizeof of_session;
  of_session.flags = PAL_SESSION_NO_REAL_TIME;
  of_session.device = &device;
  PAL_EXPECT_OK(pal_session_open(opened.scene, &of_session, &opened.session));
}

TEST(CLibrary, RecordsWhatTheProgramReplaysBitByBit) {
  const files::TemporaryFolder folder;
  const std::string file = folder / "session.ticks";
  Opened opened;
  const PalContextInfo of_context = context_info();
  PAL_ASSERT_OK(pal_context_open(&of_context, &opened.context));
  const char* path = "shell";
  PalSceneInfo of_scene{};
  of_scene.size = sizeof of_scene;
  of_scene.paths = &path;
  of_scene.path_count = 1;
  PAL_ASSERT_OK(pal_scene_open(opened.context, &of_scene, &opened.scene));
  const PalDeviceInfo device = host_device();
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_HOST_TICKS;
  info.host = &device;
  info.recording = "/nowhere/session.ticks";
  EXPECT_LT(pal_session_open(opened.scene, &info, &opened.session), PAL_OK);
  EXPECT_THAT(pal_last_error(), HasSubstr("/nowhere"));
  info.recording = file.c_str();
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
  double most_n = 0.0;
  PalTick tick{};
  for (int k = 0; k < 4000; ++k) {
    tick.time_ns = 5'000'000'000 + int64_t(k) * 1'000'000;
    tick.position_m[2] = 0.065 - 25e-6 * std::max(0, k - 2000);
    double force_n[3];
    PAL_ASSERT_OK(pal_haptics_tick(opened.session, &tick, force_n));
    most_n = std::max(most_n, std::hypot(force_n[0], std::hypot(force_n[1], force_n[2])));
    if (k % 100 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_GT(most_n, 0.5);
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  const std::string replayed = folder / "replayed.txt";
  ASSERT_EQ(std::system((std::string(PALPATE_BUILD_DIR "/palpate feel shell --replay ") + file +
                         " > " + replayed + " 2>&1")
                            .c_str()),
            0)
      << files::read_bytes(replayed);
  EXPECT_THAT(files::read_bytes(replayed),
              HasSubstr("4000 ticks: every output is the recorded one, bit by bit"));
}

// Two hands of one host, in one loop: each session of the scene has its own proxy, tank and guards.
TEST(CLibrary, FeelsOneBeatingSceneWithTwoHandsInOneLoop) {
  const files::TemporaryFolder folder;
  Opened opened, of_second, of_third;
  const PalContextInfo of_context = context_info();
  PAL_ASSERT_OK(pal_context_open(&of_context, &opened.context));
  const char* path = "shell";
  const PalSceneInfo of_scene = scene_info(&path);
  PAL_ASSERT_OK(pal_scene_open(opened.context, &of_scene, &opened.scene));
  const PalDeviceInfo device = host_device();
  const std::string files[] = {folder / "first.ticks", folder / "second.ticks"};
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_HOST_TICKS;
  info.host = &device;
  info.recording = files[0].c_str();
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
  info.recording = files[1].c_str();
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &of_second.session));
  info.recording = nullptr;
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &of_third.session));

  // From both sides towards the middle; a third session is the second hand without the first.
  const auto force_z_n = [](PalSession* session, int k, double z_m) {
    const PalTick tick{{0.0, 0.0, z_m}, 5'000'000'000 + int64_t(k) * 1'000'000, 0};
    double force_n[3];
    EXPECT_EQ(pal_haptics_tick(session, &tick, force_n), PAL_OK) << pal_last_error();
    return force_n[2];
  };
  double most_n = 0.0, least_n = 0.0;
  for (int k = 0; k < 3500; ++k) {
    const double z_m = 0.065 - 25e-6 * std::max(0, k - 2000);
    most_n = std::max(most_n, force_z_n(opened.session, k, z_m));
    const double second_n = force_z_n(of_second.session, k, -z_m);
    least_n = std::min(least_n, second_n);
    ASSERT_EQ(second_n, force_z_n(of_third.session, k, -z_m)) << k;
    if (k % 100 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_GT(most_n, 0.5);
  EXPECT_LT(least_n, -0.5);
  // The heart beats for both alike.
  PalState first{}, second{};
  first.size = second.size = sizeof first;
  PAL_ASSERT_OK(pal_session_state(opened.session, &first));
  PAL_ASSERT_OK(pal_session_state(of_second.session, &second));
  EXPECT_GT(first.volumes[0].time_s, 0.0);
  EXPECT_EQ(first.volumes[0].time_s, second.volumes[0].time_s);
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  PAL_ASSERT_OK(pal_session_close(&of_second.session));
  for (const std::string& file : files) {
    PalReplay replay{};
    replay.size = sizeof replay;
    PAL_ASSERT_OK(pal_scene_replay(opened.scene, file.c_str(), nullptr, &replay));
    EXPECT_EQ(replay.ticks, 3500u);
    EXPECT_EQ(replay.different, 0u);
  }
}

TEST(CLibrary, RecordsNoSceneWhoseMotionIsNotKnown) {
  Opened opened;
  open_ball(opened, BallFrames(3));
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  const files::TemporaryFolder folder;
  const std::string file = folder / "session.ticks";
  const PalDeviceInfo device = host_device();
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_HOST_TICKS;
  info.host = &device;
  info.recording = file.c_str();
  EXPECT_EQ(pal_session_open(opened.scene, &info, &opened.session), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("give the motion"));
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(CLibrary, FeelsFramesInMemory) {
  Opened opened;
  open_ball(opened, BallFrames());
  PalVolume volume{};
  volume.size = sizeof volume;
  PAL_ASSERT_OK(pal_scene_volume(opened.scene, 0, &volume));
  EXPECT_EQ(volume.frame_count, 1U);
  EXPECT_NEAR(volume.high_m[0], 0.032, 0.0011);
  // The box along the data's own axes fills the one along volume space's.
  for (int a = 0; a < 3; ++a) {
    double low = volume.corner_m[a], high = low;
    for (int edge = 0; edge < 3; ++edge) {
      low += std::min(volume.edges_m[3 * edge + a], 0.0);
      high += std::max(volume.edges_m[3 * edge + a], 0.0);
    }
    EXPECT_NEAR(low, volume.low_m[a], 1e-12);
    EXPECT_NEAR(high, volume.high_m[a], 1e-12);
  }
  EXPECT_EQ(pal_scene_volume(opened.scene, 1, &volume), PAL_END);
  HostHand hand{opened.session};
  const double z_m = hand.press(1.0);
  // A spring of 600 N/m gives 1 N at 1.7 mm below the surface, and less during the start ramp.
  EXPECT_NEAR(z_m, 0.020 - 1.0 / 600.0, 0.0006);
  for (int k = 0; k < 3000; ++k) hand.at(0.018);
  EXPECT_NEAR(hand.force_n[0], 0.0, 0.01);
  PalState state{};
  state.size = sizeof state;
  PAL_ASSERT_OK(pal_session_state(opened.session, &state));
  EXPECT_TRUE(state.in_contact);
  EXPECT_EQ(state.time_ns, hand.time_ns);
  EXPECT_NEAR(state.hand_m[2], 0.018, 1e-4);
  // The surface is between the two values, within the width of the ball's edge.
  EXPECT_NEAR(state.proxy_m[2], 0.020, 0.5e-3);
  EXPECT_NEAR(hand.force_n[2], 600.0 * (state.proxy_m[2] - state.hand_m[2]), 0.02);
  EXPECT_NEAR(state.force_n[2], hand.force_n[2], 1e-12);
  // What the spring asked for minus all that limiters hold back is the force.
  EXPECT_EQ(state.limiter_count, 14U);
  for (int a = 0; a < 3; ++a) {
    double left_n = state.asked_n[a];
    for (uint32_t k = 0; k < state.limiter_count; ++k) left_n -= state.limiters[k].held_n[a];
    EXPECT_NEAR(left_n, state.force_n[a], 1e-9) << a;
  }
  std::set<std::string> words;
  for (uint32_t k = 0; k < state.limiter_count; ++k) words.insert(state.limiters[k].word);
  EXPECT_EQ(words.size(), state.limiter_count);
  EXPECT_GT(state.asked_n[2], 0.5);
  EXPECT_EQ(state.volume_count, 1U);
  EXPECT_STREQ(state.cause, "");
  PAL_EXPECT_OK(pal_session_stop(opened.session));
  EXPECT_EQ(pal_session_at_rest(opened.session), 0);
  hand.worst_change_n = 0.0;
  for (int k = 0; k < 600; ++k) hand.at(0.018);
  EXPECT_EQ(pal_session_at_rest(opened.session), 1);
  EXPECT_EQ(hand.size(), 0.0);
  EXPECT_LT(hand.worst_change_n, 0.1);
}

TEST(CLibrary, TakesEverySampleTypeForTheSameVolume) {
  BallFrames ball;
  const auto pressed = [&](PalSampleType type, const void* samples) {
    BallFrames given;
    given.info.sample_type = type;
    given.pointers[0] = samples;
    Opened opened;
    open_ball(opened, given);
    HostHand hand{opened.session};
    return hand.press(1.0);
  };
  std::vector<double> f64(ball.samples[0].begin(), ball.samples[0].end());
  std::vector<int16_t> i16;
  std::vector<uint16_t> u16;
  std::vector<int32_t> i32;
  std::vector<uint32_t> u32;
  for (float& value : ball.samples[0]) {
    value = std::round(value);
    i16.push_back(int16_t(value));
    u16.push_back(uint16_t(value));
    i32.push_back(int32_t(value));
    u32.push_back(uint32_t(value));
  }
  const double exact = pressed(PAL_FLOAT32, ball.samples[0].data());
  EXPECT_EQ(pressed(PAL_INT16, i16.data()), exact);
  EXPECT_EQ(pressed(PAL_UINT16, u16.data()), exact);
  EXPECT_EQ(pressed(PAL_INT32, i32.data()), exact);
  EXPECT_EQ(pressed(PAL_UINT32, u32.data()), exact);
  EXPECT_NEAR(pressed(PAL_FLOAT64, f64.data()), exact, 1e-4);
}

TEST(CLibrary, TakesAGridWhateverItsAxes) {
  // The same ball with i and k exchanged, and with j reversed: it is still a ball.
  for (const auto& direction : {std::array<double, 9>{0, 0, 1, 0, 1, 0, 1, 0, 0},
                                std::array<double, 9>{1, 0, 0, 0, -1, 0, 0, 0, 1}}) {
    BallFrames ball;
    for (int a = 0; a < 9; ++a) ball.info.grid.direction[a] = direction[size_t(a)];
    Opened opened;
    open_ball(opened, ball);
    HostHand hand{opened.session};
    EXPECT_NEAR(hand.press(1.0), 0.020 - 1.0 / 600.0, 0.0006);
  }
}

TEST(CLibrary, RefusesBadFramesInOneSentence) {
  const PalContextInfo context = context_info();
  Opened opened;
  PAL_ASSERT_OK(pal_context_open(&context, &opened.context));
  const auto refusal = [&](const BallFrames& ball) {
    const char* path = "ball";
    PalSceneInfo scene = scene_info(&path, 0, &ball.info);
    PalScene* never = nullptr;
    EXPECT_LT(pal_scene_open(opened.context, &scene, &never), PAL_OK);
    EXPECT_EQ(never, nullptr);
    const std::string sentence = pal_last_error();
    EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
    return sentence;
  };
  BallFrames ball;
  ball.samples[0][77] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(refusal(ball), HasSubstr("not finite"));
  ball = BallFrames();
  ball.info.grid.spacing_mm[1] = -1.0;
  EXPECT_THAT(refusal(ball), HasSubstr("ball"));
  ball = BallFrames();
  ball.info.grid.direction[0] = 1.0;
  EXPECT_THAT(refusal(ball), HasSubstr("ball"));
  ball = BallFrames();
  ball.info.grid.size[2] = 0;
  refusal(ball);
  ball = BallFrames();
  ball.pointers[0] = nullptr;
  EXPECT_THAT(refusal(ball), HasSubstr("no samples"));
  ball = BallFrames();
  const int no_type = 77;
  std::memcpy(&ball.info.sample_type, &no_type, sizeof no_type);
  EXPECT_THAT(refusal(ball), HasSubstr("sample type"));
  BallFrames two(2);
  const double times_s[] = {0.0, 0.0};
  two.info.times_s = times_s;
  EXPECT_THAT(refusal(two), HasSubstr("rise"));
}

TEST(CLibrary, TakesAJsonSceneWithFramesInMemory) {
  const BallFrames ball;
  const PalContextInfo context = context_info();
  Opened opened;
  PAL_ASSERT_OK(pal_context_open(&context, &opened.context));
  PalSceneInfo scene{};
  scene.size = sizeof scene;
  scene.json =
      R"({"stiffness_n_per_m": 800, "volumes": [{"name": "thing", "files": ["ball"]}],
          "modes": [{"name": "wall", "kind": "surface", "volume": "thing",
                     "strength": {"pairs": [[0, 0], [500, 0], [500, 3]]}}]})";
  scene.frames = &ball.info;
  scene.frame_sets = 1;
  const PalResult opening = pal_scene_open(opened.context, &scene, &opened.scene);
  ASSERT_EQ(opening, PAL_OK) << pal_last_error();
  size_t length = 0;
  PAL_ASSERT_OK(pal_scene_text(opened.scene, PAL_SCENE_TEXT_PLAN, nullptr, 0, &length));
  std::string plan(length + 1, 'x');
  PAL_ASSERT_OK(
      pal_scene_text(opened.scene, PAL_SCENE_TEXT_PLAN, plan.data(), plan.size(), nullptr));
  EXPECT_THAT(plan, HasSubstr("wall"));
  EXPECT_EQ(plan.back(), '\0');
  char few[4] = "xyz";
  PAL_ASSERT_OK(pal_scene_text(opened.scene, PAL_SCENE_TEXT_PLAN, few, sizeof few, nullptr));
  EXPECT_EQ(std::string(few), plan.substr(0, 3));
  const PalDeviceInfo device = host_device();
  PalSessionInfo session{};
  session.size = sizeof session;
  session.flags = PAL_SESSION_HOST_TICKS;
  session.host = &device;
  PAL_ASSERT_OK(pal_session_open(opened.scene, &session, &opened.session));
  HostHand hand{opened.session};
  hand.press(1.0);
  for (int k = 0; k < 3000; ++k) hand.at(0.0185);
  // A step of the strength at the value 500, which is at 20 mm with the error of cubic splines on
  // voxels of 2 mm.
  EXPECT_NEAR(hand.force_n[2], 800.0 * 0.0015, 0.02);
  scene.json = R"({"volumes": [{"name": "thing", "files": ["ball"], "colour": 3}]})";
  PalScene* never = nullptr;
  EXPECT_EQ(pal_scene_open(opened.context, &scene, &never), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("colour"));
}

TEST(CLibrary, PlacesVolumesThatMayBePlaced) {
  Opened opened;
  open_ball(opened, BallFrames(), PAL_SCENE_MOVABLE);
  const double nearer[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.005};
  const double sheared[12] = {1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  HostHand hand{opened.session};
  const double z_m = hand.press(1.0);
  EXPECT_EQ(pal_session_place(opened.session, 0, sheared), PAL_BAD_INPUT);
  EXPECT_EQ(pal_session_place(opened.session, 3, nearer), PAL_BAD_INPUT);
  for (int k = 0; k < 1500; ++k) {
    hand.at(z_m + 0.01);
    if (k % 16 == 0) {
      PAL_EXPECT_OK(pal_session_place(opened.session, 0, nearer));
    }
    ::usleep(200);
  }
  EXPECT_NEAR(hand.press(1.0), z_m + 0.005, 0.0004);
  Opened still;
  open_ball(still, BallFrames());
  EXPECT_EQ(pal_session_place(still.session, 0, nearer), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("PAL_SCENE_MOVABLE"));
}

TEST(CLibrary, SwitchesModesByARamp) {
  Opened opened;
  open_ball(opened, BallFrames());
  HostHand hand{opened.session};
  hand.press(1.0);
  for (int k = 0; k < 2000; ++k) hand.at(0.018);
  const double full_n = hand.size();
  hand.worst_change_n = 0.0;
  PAL_EXPECT_OK(pal_session_set_mode(opened.session, 0, 0, 1.0));
  for (int k = 0; k < 1000; ++k) hand.at(0.018);
  EXPECT_EQ(hand.size(), 0.0);
  EXPECT_GT(full_n, 0.5);
  EXPECT_LT(hand.worst_change_n, 0.1);
  EXPECT_EQ(pal_session_set_mode(opened.session, 9, 1, 1.0), PAL_BAD_INPUT);
  EXPECT_EQ(pal_session_set_mode(opened.session, 0, 1, std::nan("")), PAL_BAD_INPUT);
  EXPECT_EQ(pal_session_scrub(opened.session, 1.5), PAL_BAD_INPUT);
}

TEST(CLibrary, SwitchesAModeAsAWholeOrNotAtAll) {
  Opened opened;
  open_ball(opened, BallFrames());
  // 256 changes can be buffered. After one, and 127 times two, there is room for half of the next
  // call.
  PAL_ASSERT_OK(pal_session_rearm(opened.session));
  for (int k = 0; k < 127; ++k) PAL_ASSERT_OK(pal_session_set_mode(opened.session, 0, 1, 1.0));
  EXPECT_EQ(pal_session_set_mode(opened.session, 0, 0, 1.0), PAL_NOT_YET);
  PAL_EXPECT_OK(pal_session_rearm(opened.session));
  HostHand hand{opened.session};
  EXPECT_GT(hand.press(1.0), 0.0) << "the call that was refused still switched the mode off";
}

TEST(CLibrary, TellsOfEachVolume) {
  Opened opened;
  open_ball(opened, BallFrames());
  PalVolumeState volume{};
  EXPECT_EQ(pal_session_volume(opened.session, 0, &volume), PAL_BAD_VERSION);
  volume.size = sizeof volume;
  EXPECT_EQ(pal_session_volume(opened.session, 0, &volume), PAL_NOT_YET);
  HostHand hand{opened.session};
  for (int k = 0; k < 100; ++k) hand.at(0.03);
  PAL_ASSERT_OK(pal_session_volume(opened.session, 0, &volume));
  PalState state{};
  state.size = sizeof state;
  PAL_ASSERT_OK(pal_session_state(opened.session, &state));
  for (int k = 0; k < 12; ++k)
    EXPECT_EQ(volume.world_from_volume[k], state.volumes[0].world_from_volume[k]) << k;
  EXPECT_EQ(volume.world_from_volume[0], 1.0);
  EXPECT_EQ(volume.time_s, state.volumes[0].time_s);
  EXPECT_EQ(volume.rate, state.volumes[0].rate);
  EXPECT_EQ(pal_session_volume(opened.session, 1, &volume), PAL_END);
  // The memory behind an older program's structure is not written.
  volume.rate = -77.0;
  volume.size = offsetof(PalVolumeState, rate);
  PAL_ASSERT_OK(pal_session_volume(opened.session, 0, &volume));
  EXPECT_EQ(volume.rate, -77.0);
}

TEST(CLibrary, TakesGarbageOfItsHostForAFault) {
  Opened opened;
  open_ball(opened, BallFrames());
  HostHand hand{opened.session};
  hand.press(1.0);
  for (int k = 0; k < 1000; ++k) hand.at(0.018);
  ASSERT_GT(hand.size(), 0.8);
  hand.worst_change_n = 0.0;
  for (int k = 0; k < 200; ++k) hand.at(std::nan(""));
  EXPECT_EQ(hand.size(), 0.0);
  EXPECT_LT(hand.worst_change_n, 0.6);
  PalState state{};
  state.size = sizeof state;
  PAL_ASSERT_OK(pal_session_state(opened.session, &state));
  EXPECT_STRNE(state.cause, "");
  double force_n[3] = {1.0, 1.0, 1.0};
  EXPECT_EQ(pal_haptics_tick(opened.session, nullptr, force_n), PAL_BAD_INPUT);
  EXPECT_EQ(force_n[0], 0.0);
}

/// A host's device that presses on the ball.
struct Pressing {
  std::atomic<int> exchanges{0};
  std::atomic<double> z_m{0.03}, last_n{0.0};
  std::atomic<bool> throws{false};
  // Read after the session is closed.
  std::vector<double> while_throwing_n;
  static void exchange(void* user, const double force_n[3], PalReading* reading) {
    auto* const self = static_cast<Pressing*>(user);
    ++self->exchanges;
    self->last_n = force_n[2];
    if (self->throws) {
      self->while_throwing_n.push_back(force_n[2]);
      throw std::runtime_error("the arm is gone");
    }
    reading->position_m[2] = self->z_m;
    reading->is_fresh = 1;
  }
};

TEST(CLibrary, DrivesADeviceOfTheHostsOnItsOwnThread) {
  Opened opened;
  const BallFrames ball;
  open_ball(opened, ball);
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  Pressing pressing;
  const PalDeviceInfo about = host_device();
  PalDevice device = device_of(about, &pressing, &Pressing::exchange);
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_NO_REAL_TIME;
  info.device = &device;
  // Long, because other tests run at the same time.
  info.watchdog_s = 0.2;
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
  double force_n[3];
  const PalTick tick{};
  EXPECT_EQ(pal_haptics_tick(opened.session, &tick, force_n), PAL_BAD_INPUT);
  for (int k = 0; k < 2500; ++k) {
    pressing.z_m = std::max(0.018, 0.03 - 6e-6 * k);
    ::usleep(1000);
  }
  EXPECT_GT(pressing.exchanges, 1000);
  EXPECT_GT(pressing.last_n, 0.3);
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  EXPECT_EQ(pressing.last_n, 0.0);
  const int after = pressing.exchanges;
  ::usleep(20'000);
  EXPECT_EQ(pressing.exchanges, after) << "the device is used after the session is closed";
}

double shaft_y(PalSession* session) {
  PalState state{};
  state.size = sizeof state;
  EXPECT_EQ(pal_session_state(session, &state), PAL_OK) << pal_last_error();
  EXPECT_EQ(state.shaft[0], 0.0);
  return state.shaft[1];
}

TEST(CLibrary, TakesHowTheGripIsHeldFromTheHostsTicks) {
  Opened opened;
  open_ball(opened, BallFrames());
  // A quarter about x: the shaft goes down.
  PalGrip grip{};
  grip.size = sizeof grip;
  grip.senses = PAL_GRIP_TURNS;
  grip.device_from_grip[0] = grip.device_from_grip[1] = std::sqrt(0.5);
  PalTick tick{{0.0, 0.0, 0.05}, 1'000'000'000, 0};
  double force_n[3];
  const auto ticked = [&] {
    tick.time_ns += 1'000'000;
    PAL_EXPECT_OK(pal_haptics_tick(opened.session, &tick, force_n));
    return shaft_y(opened.session);
  };
  EXPECT_EQ(ticked(), 0.0);
  PAL_EXPECT_OK(pal_haptics_hold(opened.session, &grip));
  EXPECT_NEAR(ticked(), -1.0, 1e-12);
  EXPECT_NEAR(ticked(), -1.0, 1e-12) << "until another one is given";
  // A rotation that is none is not sensed, and is no fault.
  grip.device_from_grip[0] = std::nan("");
  PAL_EXPECT_OK(pal_haptics_hold(opened.session, &grip));
  EXPECT_EQ(ticked(), 0.0);

  EXPECT_EQ(pal_haptics_hold(opened.session, nullptr), PAL_BAD_INPUT);
  grip.senses = 1u << 7;
  EXPECT_EQ(pal_haptics_hold(opened.session, &grip), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("senses"));
  grip.size = sizeof grip + 8;
  EXPECT_EQ(pal_haptics_hold(opened.session, &grip), PAL_BAD_VERSION);
  EXPECT_EQ(pal_haptics_hold(nullptr, &grip), PAL_BAD_INPUT);
}

TEST(CLibrary, TakesHowTheGripIsHeldFromADeviceOfTheHosts) {
  Opened opened;
  const BallFrames ball;
  open_ball(opened, ball);
  const PalDeviceInfo about = host_device();
  PalDevice device = device_of(about, nullptr, [](void*, const double*, PalReading* reading) {
    reading->position_m[2] = 0.05;
    reading->is_fresh = 1;
  });
  device.grip = [](void*, PalGrip* grip) {
    EXPECT_EQ(grip->size, sizeof(PalGrip));
    EXPECT_EQ(grip->senses, 0u);
    grip->senses = PAL_GRIP_TURNS | PAL_GRIP_OPENS;
    grip->device_from_grip[0] = grip->device_from_grip[1] = std::sqrt(0.5);
    grip->opening_rad = 0.2;
  };
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_NO_REAL_TIME;
  info.device = &device;
  // A program of before has no `grip`.
  for (const bool has_grip : {true, false}) {
    device.size = has_grip ? sizeof device : offsetof(PalDevice, grip);
    PAL_ASSERT_OK(pal_session_close(&opened.session));
    PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
    PalState state{};
    state.size = sizeof state;
    for (int k = 0; k < 10'000 && state.time_ns == 0; ++k) {
      ::usleep(1000);
      PAL_ASSERT_OK(pal_session_state(opened.session, &state));
    }
    EXPECT_NEAR(state.shaft[1], has_grip ? -1.0 : 0.0, 1e-12);
    EXPECT_EQ(pal_haptics_hold(opened.session, nullptr), PAL_BAD_INPUT);
  }
}

// A finger pad beside the top of the ball is turned by it. With host ticks the torque is that of
// the tick; the state has it along the world's axes.
TEST(CLibrary, GivesTheTorqueOnAFingerPad) {
  Opened opened;
  open_ball(opened, BallFrames());
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  PalDeviceInfo device = host_device();
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_HOST_TICKS;
  info.host = &device;
  info.options = R"({"tool_points": 4, "tool_radius_mm": 6})";
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
  PalTick tick{{0.004, 0.0, 0.04}, 1'000'000'000, 0};
  double force_n[3], torque_n_m[3];
  for (int k = 0; k < 6000; ++k) {
    tick.time_ns += 1'000'000;
    tick.position_m[2] = std::max(0.019, 0.04 - 1e-5 * k);
    PAL_ASSERT_OK(pal_haptics_tick(opened.session, &tick, force_n));
    PAL_ASSERT_OK(pal_haptics_torque(opened.session, torque_n_m));
    if (force_n[2] == 0.0 && force_n[0] == 0.0) {
      ASSERT_EQ(torque_n_m[1], 0.0);
    }
  }
  EXPECT_GT(force_n[2], 0.3);
  // The points towards the middle are pressed most: they turn the pad about y, z towards x.
  EXPECT_GT(torque_n_m[1], 1e-4);
  EXPECT_NEAR(torque_n_m[0], 0.0, 1e-5);
  PalState state{};
  state.size = sizeof state;
  PAL_ASSERT_OK(pal_session_state(opened.session, &state));
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(state.torque_n_m[a], torque_n_m[a], 1e-12);

  EXPECT_EQ(pal_haptics_torque(opened.session, nullptr), PAL_BAD_INPUT);
  EXPECT_EQ(pal_haptics_torque(nullptr, torque_n_m), PAL_BAD_INPUT);
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  // A device of the host's says both how much it can give and how it gets it, or neither.
  info.flags = 0;
  info.options = nullptr;
  device.max_torque_n_m = 0.1;
  const PalDevice without = device_of(device, nullptr, [](void*, const double*, PalReading*) {});
  info.device = &without;
  EXPECT_EQ(pal_session_open(opened.scene, &info, &opened.session), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("max_torque_n_m"));
}

/// The beating shell, ticked by the test, and its stream tubes.
class ShellTubes {
 public:
  explicit ShellTubes(uint32_t context_flags = PAL_CONTEXT_NO_GPU) {
    const PalContextInfo context = context_info(context_flags);
    if (pal_context_open(&context, &opened.context) != PAL_OK) return;
    PalSceneInfo scene{};
    scene.size = sizeof scene;
    const char* path = "shell";
    scene.paths = &path;
    scene.path_count = 1;
    PAL_EXPECT_OK(pal_scene_open(opened.context, &scene, &opened.scene));
    const PalDeviceInfo device = host_device();
    PalSessionInfo info{};
    info.size = sizeof info;
    info.flags = PAL_SESSION_HOST_TICKS;
    info.host = &device;
    info.tube_buttons = 1U << 3;
    PAL_EXPECT_OK(pal_session_open(opened.scene, &info, &opened.session));
  }
  void tick(double z_m = 0.03, uint32_t buttons = 0) {
    const PalTick tick{{0.0, 0.0, z_m}, time_ns_ += 1'000'000, buttons};
    double force_n[3];
    PAL_EXPECT_OK(pal_haptics_tick(opened.session, &tick, force_n));
  }
  uint32_t count() {
    PalTube tube{};
    tube.size = sizeof tube;
    uint32_t tubes = 0;
    while (pal_session_tube(opened.session, tubes, &tube) == PAL_OK) ++tubes;
    return tubes;
  }
  bool comes_to(uint32_t tubes, uint32_t buttons = 0) {
    for (int k = 0; k < 10000 && count() != tubes; ++k) {
      tick(0.03, buttons);
      ::usleep(1000);
    }
    return count() == tubes;
  }
  PalTube tube(uint32_t index) {
    PalTube known{};
    known.size = sizeof known;
    PAL_EXPECT_OK(pal_session_tube(opened.session, index, &known));
    points_m.assign(size_t(3) * known.point_count, -77.0);
    lengths.assign(known.point_count, -77.0);
    known.capacity = known.point_count;
    known.points_m = points_m.data();
    known.lengths = lengths.data();
    PAL_EXPECT_OK(pal_session_tube(opened.session, index, &known));
    return known;
  }

  Opened opened;
  std::vector<double> points_m, lengths;

 private:
  int64_t time_ns_ = 5'000'000'000;
};

TEST(CLibrary, FillsTheShorterTubesOfOlderPrograms) {
  ShellTubes shell;
  PAL_ASSERT_OK(pal_session_ask_tubes(shell.opened.session, PAL_TUBES_RELEASE));
  ASSERT_TRUE(shell.comes_to(1));
  const char* const untouched = "untouched";
  PalTube tube{};
  tube.size = offsetof(PalTube, length_unit);
  tube.length_unit = untouched;
  PAL_ASSERT_OK(pal_session_tube(shell.opened.session, 0, &tube));
  EXPECT_GT(tube.point_count, 3U);
  EXPECT_EQ(tube.length_unit, untouched);
}

TEST(CLibrary, LaysStreamTubesThatGoWithTheMotion) {
  ShellTubes shell;
  PAL_ASSERT_OK(pal_session_ask_tubes(shell.opened.session, PAL_TUBES_RELEASE));
  ASSERT_TRUE(shell.comes_to(1));
  const PalTube tube = shell.tube(0);
  EXPECT_EQ(tube.field, PAL_TUBE_VELOCITY);
  EXPECT_STREQ(tube.length_unit, "m/s");
  EXPECT_EQ(tube.volume, 0U);
  EXPECT_EQ(tube.is_kept, 0U);
  ASSERT_GT(tube.point_count, 3U);
  ASSERT_LT(tube.seed_point, tube.point_count);
  // On the z axis, along which the hand and the wall move. The points of another phase are
  // elsewhere on it.
  for (size_t k = 0; k < tube.point_count; ++k) {
    EXPECT_NEAR(shell.points_m[3 * k], 0.0, 1e-4);
    EXPECT_NEAR(shell.points_m[3 * k + 1], 0.0, 1e-4);
    EXPECT_GE(shell.lengths[k], 0.0);
  }
  const double seed_m = shell.points_m[3 * tube.seed_point + 2];
  EXPECT_NEAR(seed_m, 0.03, 0.005);
  for (int k = 0; k < 500; ++k) shell.tick();
  shell.tube(0);
  EXPECT_GT(std::abs(shell.points_m[3 * tube.seed_point + 2] - seed_m), 1e-4)
      << "the tube does not move";
  // With less room than points, the first ones are returned.
  std::vector<double> few(6, -77.0);
  PalTube small{};
  small.size = sizeof small;
  small.capacity = 1;
  small.points_m = few.data();
  PAL_ASSERT_OK(pal_session_tube(shell.opened.session, 0, &small));
  EXPECT_EQ(small.point_count, tube.point_count);
  EXPECT_NE(few[0], -77.0);
  EXPECT_EQ(few[3], -77.0);

  PAL_ASSERT_OK(pal_session_ask_tubes(shell.opened.session, PAL_TUBES_KEEP));
  shell.tick();
  ASSERT_TRUE(shell.comes_to(2, 1U << 3)) << "the device's button lays none";
  EXPECT_EQ(shell.tube(0).is_kept, 1U);
  EXPECT_EQ(shell.tube(1).is_kept, 0U);
  const files::TemporaryFolder folder;
  const std::string path = (folder.path() / "tubes.vtk").string();
  PAL_ASSERT_OK(pal_session_save_tubes(shell.opened.session, path.c_str()));
  std::ifstream written(path);
  const std::string all((std::istreambuf_iterator<char>(written)), {});
  EXPECT_THAT(all, HasSubstr("LINES 2 "));
  PAL_ASSERT_OK(pal_session_ask_tubes(shell.opened.session, PAL_TUBES_CLEAR));
  ASSERT_TRUE(shell.comes_to(1));
  EXPECT_EQ(shell.tube(0).is_kept, 1U);
  PAL_ASSERT_OK(pal_session_ask_tubes(shell.opened.session, PAL_TUBES_CLEAR));
  ASSERT_TRUE(shell.comes_to(0));

  EXPECT_EQ(pal_session_save_tubes(shell.opened.session, "tubes.csv"), PAL_BAD_OUTPUT);
  EXPECT_EQ(pal_session_save_tubes(shell.opened.session, nullptr), PAL_BAD_INPUT);
  EXPECT_EQ(pal_session_ask_tubes(shell.opened.session, PalTubesAction(17)), PAL_BAD_INPUT);
  EXPECT_EQ(pal_session_ask_tubes(nullptr, PAL_TUBES_KEEP), PAL_BAD_INPUT);
  EXPECT_EQ(pal_session_tube(shell.opened.session, 0, nullptr), PAL_BAD_INPUT);
  PalTube wrong{};
  wrong.size = sizeof wrong + 8;
  EXPECT_EQ(pal_session_tube(shell.opened.session, 0, &wrong), PAL_BAD_VERSION);
}

TEST(CLibrary, DrawsStreamTubes) {
  ShellTubes shell(0);
  if (!shell.opened.session) GTEST_SKIP() << pal_last_error();
  PalViewInfo info{};
  info.size = sizeof info;
  info.flags = PAL_VIEW_NO_HAND | PAL_VIEW_NO_BOX;
  info.width = 128;
  info.height = 96;
  info.eye_count = 1;
  PAL_ASSERT_OK(pal_view_open(shell.opened.session, &info, &shell.opened.view));
  const auto picture = [&] {
    // Always at the same phase: between laying and drawing the tube nothing moves.
    const PalEye eye{
        {0.12, 0.0, 0.0}, {0.0, std::sqrt(0.5), 0.0, std::sqrt(0.5)}, -0.4, 0.4, -0.3, 0.3};
    std::vector<uint32_t> pixels(128 * 96);
    PAL_EXPECT_OK(pal_view_render(shell.opened.view, &eye, 1, 128, 96, 0.0, nullptr));
    PAL_EXPECT_OK(pal_view_read(shell.opened.view, 0, pixels.data(), nullptr));
    return pixels;
  };
  // Outside the wall, where the tube is visible. The scene is paused, so only the tube is new.
  for (int k = 0; k < 1000; ++k) shell.tick(0.036);
  PAL_ASSERT_OK(pal_session_play(shell.opened.session, 0));
  for (int k = 0; k < 1000; ++k) shell.tick(0.036);
  const std::vector<uint32_t> without = picture();
  ASSERT_EQ(picture(), without) << "the picture changes although the scene is paused";
  PAL_ASSERT_OK(pal_session_ask_tubes(shell.opened.session, PAL_TUBES_RELEASE));
  shell.tick(0.036);
  for (int k = 0; k < 10000 && shell.count() == 0; ++k) ::usleep(1000);
  ASSERT_EQ(shell.count(), 1U);
  const std::vector<uint32_t> with = picture();
  int changed = 0;
  for (size_t p = 0; p < with.size(); ++p) changed += with[p] != without[p];
  EXPECT_GT(changed, 5);
}

/// Of a colour that is encoded as sRGB, 0 to 255.
double linear_of(uint32_t byte) {
  const double c = byte / 255.0;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

TEST(CLibrary, DrawsWithoutABackground) {
  ShellTubes shell(0);
  if (!shell.opened.session) GTEST_SKIP() << pal_last_error();
  shell.tick(0.036);
  PalViewInfo info{};
  info.size = sizeof info;
  info.flags = PAL_VIEW_NO_BACKGROUND | PAL_VIEW_NO_HAND | PAL_VIEW_NO_BOX;
  info.width = 96;
  info.height = 64;
  info.eye_count = 1;
  std::vector<uint32_t> pixels(96 * 64);
  const PalEye eye{{0.0, 0.0, 0.12}, {0.0, 0.0, 0.0, 1.0}, -0.6, 0.6, -0.4, 0.4};
  PAL_ASSERT_OK(pal_view_open(shell.opened.session, &info, &shell.opened.view));
  PAL_ASSERT_OK(pal_view_render(shell.opened.view, &eye, 1, 96, 64, 0.0, nullptr));
  PAL_ASSERT_OK(pal_view_read(shell.opened.view, 0, pixels.data(), nullptr));
  EXPECT_EQ(pixels[0], 0U) << "a corner of the picture is empty";
  // No colour is brighter than its opacity: both add up in the host's picture.
  int thin = 0;
  for (const uint32_t pixel : pixels) {
    const double opacity = (pixel >> 24) / 255.0;
    thin += opacity > 0.1 && opacity < 0.9;
    for (int c = 0; c < 24; c += 8) ASSERT_LE(linear_of(pixel >> c & 255U), opacity + 0.01);
  }
  EXPECT_GT(thin, 5) << "all pixels are full or empty";
}

TEST(CLibrary, DrawsShadowsUnlessToldNotTo) {
  ShellTubes shell(0);
  if (!shell.opened.session) GTEST_SKIP() << pal_last_error();
  shell.tick(0.036);
  const PalEye eye{{0.0, 0.06, 0.12}, {0.0, 0.0, 0.0, 1.0}, -0.6, 0.6, -0.4, 0.4};
  const auto drawn = [&](uint32_t flags) {
    PalViewInfo info{};
    info.size = sizeof info;
    info.flags = flags | PAL_VIEW_NO_HAND | PAL_VIEW_NO_BOX | PAL_VIEW_CUT_OPEN;
    info.width = 96;
    info.height = 64;
    info.eye_count = 1;
    std::vector<uint32_t> pixels(96 * 64);
    PalView* view = nullptr;
    PAL_EXPECT_OK(pal_view_open(shell.opened.session, &info, &view));
    PAL_EXPECT_OK(pal_view_render(view, &eye, 1, 96, 64, 0.0, nullptr));
    PAL_EXPECT_OK(pal_view_read(view, 0, pixels.data(), nullptr));
    PAL_EXPECT_OK(pal_view_close(&view));
    return pixels;
  };
  const std::vector<uint32_t> with = drawn(0), without = drawn(PAL_VIEW_NO_SHADOWS);
  int darker = 0, brighter = 0;
  for (size_t p = 0; p < with.size(); ++p) {
    darker += (with[p] & 255U) + 5 < (without[p] & 255U);
    brighter += (with[p] & 255U) > (without[p] & 255U) + 5;
  }
  EXPECT_GT(darker, 100);
  EXPECT_EQ(brighter, 0);
}

/// What a host's functions report to the test, on any thread.
struct Sentences {
  std::mutex mutex;
  std::vector<std::string> all;
  void add(const char* sentence) {
    const std::lock_guard lock(mutex);
    all.emplace_back(sentence);
  }
  bool has(const std::string& part) {
    const std::lock_guard lock(mutex);
    return std::any_of(all.begin(), all.end(), [&](const std::string& sentence) {
      return sentence.find(part) != std::string::npos;
    });
  }
  bool comes_to_have(const std::string& part) {
    for (int k = 0; k < 10000 && !has(part); ++k) ::usleep(1000);
    return has(part);
  }
};

TEST(CLibrary, EndsTheForceByARampWhereTheHostsDeviceThrows) {
  Sentences told;  // outlives the session
  Pressing pressing;
  Opened opened;
  const BallFrames ball;
  open_ball(opened, ball);
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  const PalDeviceInfo about = host_device();
  PalDevice device = device_of(about, &pressing, &Pressing::exchange);
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_NO_REAL_TIME;
  info.device = &device;
  // Long, because other tests run at the same time.
  info.watchdog_s = 0.2;
  info.user = &told;
  info.on_event = [](void* user, PalEventKind kind, const char* sentence) {
    if (kind == PAL_EVENT_NOTE) static_cast<Sentences*>(user)->add(sentence);
  };
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
  for (int k = 0; k < 20000 && pressing.last_n < 0.5; ++k) {
    pressing.z_m = std::max(0.017, 0.03 - 6e-6 * k);
    ::usleep(1000);
  }
  ASSERT_GE(pressing.last_n, 0.5);
  pressing.throws = true;
  EXPECT_TRUE(told.comes_to_have("exchange threw an exception: the arm is gone"));
  for (int k = 0; k < 5000 && pressing.last_n != 0.0; ++k) ::usleep(1000);
  EXPECT_EQ(pressing.last_n, 0.0);
  PalState state{};
  state.size = sizeof state;
  PAL_ASSERT_OK(pal_session_state(opened.session, &state));
  EXPECT_STRNE(state.cause, "");
  // The fault ends when the device works again and the hand is free.
  pressing.z_m = 0.04;
  pressing.throws = false;
  for (int k = 0; k < 10000 && *state.cause; ++k) {
    ::usleep(1000);
    PAL_ASSERT_OK(pal_session_state(opened.session, &state));
  }
  EXPECT_STREQ(state.cause, "");
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  EXPECT_EQ(std::count_if(told.all.begin(), told.all.end(),
                          [](const std::string& one) {
                            return one.find("exchange threw") != std::string::npos;
                          }),
            1)
      << "it is reported once";
  const auto& force_n = pressing.while_throwing_n;
  ASSERT_GT(force_n.size(), 3U);
  const double before_n = force_n.front();
  EXPECT_GT(std::count_if(force_n.begin(), force_n.end(),
                          [&](double n) { return n > 0.1 * before_n && n < 0.9 * before_n; }),
            3)
      << "no ramp is started";
}

TEST(CLibrary, GoesOnWhereTheHostsLogAndEventsThrow) {
  struct Heard {
    Sentences log;
    std::atomic<int> events{0};
  } heard;  // outlives the session
  Opened opened;
  PalContextInfo context = context_info(0);
  context.user = &heard;
  context.log = [](void* user, const char* sentence) {
    static_cast<Heard*>(user)->log.add(sentence);
    throw std::runtime_error("no room in the log");
  };
  if (pal_context_open(&context, &opened.context) == PAL_NO_DEVICE)
    GTEST_SKIP() << pal_last_error();
  const BallFrames ball(2);
  const char* path = "ball";
  PalSceneInfo scene = scene_info(&path, 0, &ball.info);
  PAL_ASSERT_OK(pal_scene_open(opened.context, &scene, &opened.scene));
  EXPECT_FALSE(heard.log.all.empty());
  const PalDeviceInfo device = host_device();
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_HOST_TICKS;
  info.host = &device;
  info.preset = "fast";
  info.user = &heard;
  info.on_event = [](void* user, PalEventKind, const char*) {
    ++static_cast<Heard*>(user)->events;
    // Not a std::exception either.
    throw 17;
  };
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
  EXPECT_TRUE(heard.log.comes_to_have("on_event threw an exception"));
  EXPECT_GT(heard.events, 0);
  PalState state{};
  state.size = sizeof state;
  for (int k = 0; k < 60000 && !state.can_play; ++k) {
    ::usleep(1000);
    PAL_ASSERT_OK(pal_session_state(opened.session, &state));
  }
  EXPECT_EQ(state.can_play, 1U) << "the estimation ended";
  HostHand hand{opened.session};
  EXPECT_GT(hand.press(0.5), 0.0);
}

TEST(CLibrary, TellsAHostThatNeverTicks) {
  Opened opened;
  const BallFrames ball;
  open_ball(opened, ball);
  PalState state{};
  state.size = sizeof state;
  PAL_ASSERT_OK(pal_session_state(opened.session, &state));
  EXPECT_EQ(state.ticks, 0U);
  EXPECT_EQ(state.time_ns, 0);
  // Requests wait for a tick; when there is no room for more, the call returns this.
  PalResult result = PAL_OK;
  int asked = 0;
  while (result == PAL_OK && asked < 100'000) {
    result = pal_session_ask_tubes(opened.session, PAL_TUBES_RELEASE);
    ++asked;
  }
  EXPECT_EQ(result, PAL_NOT_YET);
  EXPECT_THAT(pal_last_error(), HasSubstr("the haptic loop does not run"));
  PalTube tube{};
  tube.size = sizeof tube;
  EXPECT_EQ(pal_session_tube(opened.session, 0, &tube), PAL_END);
  EXPECT_EQ(pal_session_at_rest(opened.session), 0);
  PAL_EXPECT_OK(pal_session_stop(opened.session));
  PAL_EXPECT_OK(pal_session_close(&opened.session));
}

TEST(CLibrary, RefusesToStopASessionFromItsDevicesExchange) {
  struct Host {
    std::atomic<PalSession*> session{nullptr};
    std::atomic<PalResult> stopped{PAL_OK}, closed{PAL_OK};
    std::atomic<bool> tried{false};
  } host;  // outlives the session
  Opened opened;
  open_ball(opened, BallFrames());
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  const PalDeviceInfo about = host_device();
  PalDevice device = device_of(about, &host, [](void* user, const double*, PalReading* reading) {
    Host& of = *static_cast<Host*>(user);
    reading->is_fresh = 1;
    if (PalSession* session = of.session; session && !of.tried) {
      of.stopped = pal_session_stop(session);
      of.closed = pal_session_close(&session);
      of.tried = true;
    }
  });
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_NO_REAL_TIME;
  info.device = &device;
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
  host.session = opened.session;
  for (int k = 0; k < 10000 && !host.tried; ++k) ::usleep(1000);
  ASSERT_TRUE(host.tried);
  EXPECT_EQ(host.stopped, PAL_BAD_INPUT);
  EXPECT_EQ(host.closed, PAL_BAD_INPUT);
  PAL_EXPECT_OK(pal_session_stop(opened.session));
  PAL_EXPECT_OK(pal_session_close(&opened.session));
}

TEST(CLibrary, RefusesASceneWhoseModeLibrariesAreMissing) {
  Opened opened;
  const PalContextInfo context = context_info(PAL_CONTEXT_NO_GPU);
  PAL_ASSERT_OK(pal_context_open(&context, &opened.context));
  const char* const shell = "shell";
  const char* const none = nullptr;
  PalSceneInfo scene{};
  scene.size = sizeof scene;
  scene.paths = &shell;
  scene.path_count = 1;
  scene.mode_library_count = 1;
  EXPECT_EQ(pal_scene_open(opened.context, &scene, &opened.scene), PAL_BAD_INPUT);
  scene.mode_libraries = &none;
  EXPECT_EQ(pal_scene_open(opened.context, &scene, &opened.scene), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("libraries of modes"));
}

TEST(CLibrary, RefusesDevicesAndNumbersThatCanNotBe) {
  Opened opened;
  open_ball(opened, BallFrames());
  PalSession* never = nullptr;
  PalSessionInfo info{};
  info.size = sizeof info;
  const auto refusal = [&] {
    EXPECT_LT(pal_session_open(opened.scene, &info, &never), PAL_OK);
    EXPECT_EQ(never, nullptr);
    return std::string(pal_last_error());
  };
  info.device_name = "phantom";
  EXPECT_THAT(refusal(), HasSubstr("'phantom'"));
  info.device_name = nullptr;
  info.flags = PAL_SESSION_HOST_TICKS;
  EXPECT_THAT(refusal(), HasSubstr("PalDeviceInfo"));
  PalDeviceInfo device = host_device();
  info.host = &device;
  device.max_force_n = 0.0;
  EXPECT_THAT(refusal(), HasSubstr("max_force_n"));
  device = host_device();
  info.max_force_n = 1e9;
  EXPECT_THAT(refusal(), HasSubstr("100 N"));
  info.max_force_n = std::nan("");
  EXPECT_THAT(refusal(), HasSubstr("max_force_n is nan"));
  info.max_force_n = 0.0;
  info.preset = "quickest";
  EXPECT_THAT(refusal(), HasSubstr("preset"));
}

TEST(CLibrary, TakesAForceDeviceOnlyIfItAnswers) {
  // The maker's library shows that a device may be there; only the device itself can confirm it.
  ::setenv("FDSDK", PALPATE_FAKE_SDK, 1);
  void* const sdk = ::dlopen(PALPATE_FAKE_DHD, RTLD_NOW | RTLD_LOCAL);
  ASSERT_TRUE(sdk) << ::dlerror();
  auto& dhd = *reinterpret_cast<decltype(&fake_dhd)>(::dlsym(sdk, "fake_dhd"))();
  Opened opened;
  open_ball(opened, BallFrames());
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_NO_REAL_TIME;
  dhd.devices = 0;
  EXPECT_EQ(pal_session_open(opened.scene, &info, &opened.session), PAL_NO_DEVICE);
  EXPECT_THAT(pal_last_error(), HasSubstr("No force device answers"));
  // A device that is named may be plugged in later.
  info.device_name = "force-dimension";
  PAL_EXPECT_OK(pal_session_open(opened.scene, &info, &opened.session));
  PAL_EXPECT_OK(pal_session_close(&opened.session));
  dhd.devices = 1;
  info.device_name = nullptr;
  PAL_EXPECT_OK(pal_session_open(opened.scene, &info, &opened.session));
  EXPECT_EQ(dhd.opened, 1);
  PAL_EXPECT_OK(pal_session_close(&opened.session));
  EXPECT_EQ(dhd.closed, 1);
  ::unsetenv("FDSDK");
}

TEST(CLibrary, RefusesHandlesThatAreClosed) {
  Opened opened;
  open_ball(opened, BallFrames());
  PalSession* const stale = opened.session;
  PAL_ASSERT_OK(pal_session_close(&opened.session));
  EXPECT_EQ(opened.session, nullptr);
  PAL_EXPECT_OK(pal_session_close(&opened.session));
  PAL_EXPECT_OK(pal_session_close(nullptr));
  PalState state{};
  state.size = sizeof state;
  EXPECT_EQ(pal_session_state(stale, &state), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("closed"));
  double force_n[3] = {1.0, 1.0, 1.0};
  const PalTick tick{};
  EXPECT_EQ(pal_haptics_tick(stale, &tick, force_n), PAL_BAD_INPUT);
  EXPECT_EQ(force_n[0], 0.0);
  EXPECT_EQ(pal_session_at_rest(nullptr), 0);
}

TEST(CLibrary, DoesNotTakeAClosedHandleForTheNextOne) {
  const PalContextInfo info = context_info();
  PalContext* context = nullptr;
  PAL_ASSERT_OK(pal_context_open(&info, &context));
  PalContext* const stale = context;
  PAL_ASSERT_OK(pal_context_close(&context));
  const char* path = "shell";
  PalSceneInfo of_scene{};
  of_scene.size = sizeof of_scene;
  of_scene.paths = &path;
  of_scene.path_count = 1;
  for (int k = 0; k < 1000; ++k) {
    PAL_ASSERT_OK(pal_context_open(&info, &context));
    ASSERT_NE(context, stale) << "after " << k << " others";
    PAL_ASSERT_OK(pal_context_close(&context));
  }
  PalScene* scene = nullptr;
  EXPECT_EQ(pal_scene_open(stale, &of_scene, &scene), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("closed"));
  // Closing it again has no effect.
  PalContext* twice = stale;
  PAL_EXPECT_OK(pal_context_close(&twice));
  // Memory does not grow for ever: a closed handle's memory is used again after some time, by one
  // new handle only.
  bool again = false;
  for (int k = 0; k < 3000; ++k) {
    PalContext* other = nullptr;
    PAL_ASSERT_OK(pal_context_open(&info, &context));
    PAL_ASSERT_OK(pal_context_open(&info, &other));
    ASSERT_NE(context, other);
    again |= context == stale || other == stale;
    PAL_ASSERT_OK(pal_context_close(&context));
    PAL_ASSERT_OK(pal_context_close(&other));
  }
  EXPECT_TRUE(again);
}

TEST(CLibrary, OutlivesTheClosingOfWhatOtherThreadsUse) {
  const BallFrames ball;
  for (int round = 0; round < 20; ++round) {
    Opened opened;
    open_ball(opened, ball);
    PalSession* const shared = opened.session;
    std::atomic<bool> end{false};
    std::thread ticking([&] {
      HostHand hand{shared};
      double force_n[3];
      while (!end) {
        const PalTick tick{{0.0, 0.0, 0.019}, hand.time_ns += 1'000'000, 0};
        pal_haptics_tick(shared, &tick, force_n);
      }
    });
    std::thread reading([&] {
      PalState state{};
      state.size = sizeof state;
      while (!end) pal_session_state(shared, &state);
    });
    ::usleep(2000);
    PAL_EXPECT_OK(pal_session_close(&opened.session));
    ::usleep(500);
    end = true;
    ticking.join();
    reading.join();
  }
}

TEST(CLibrary, IsClosedByOneOfTwoThreads) {
  // Through one variable of the host's, then through a copy per thread.
  const BallFrames ball;
  for (int round = 0; round < 200; ++round) {
    Opened opened;
    open_ball(opened, ball);
    PalSession *const handle = opened.session, *copy = handle;
    std::atomic<int> ready{0};
    const auto close = [&](PalSession** session) {
      ++ready;
      while (ready < 2) std::this_thread::yield();
      PAL_EXPECT_OK(pal_session_close(session));
      PAL_EXPECT_OK(pal_context_close(&opened.context));
      PAL_EXPECT_OK(pal_scene_close(&opened.scene));
    };
    std::thread other(close, round % 2 ? &copy : &opened.session);
    close(&opened.session);
    other.join();
    EXPECT_EQ(opened.session, nullptr);
    EXPECT_EQ(opened.context, nullptr);
    EXPECT_EQ(opened.scene, nullptr);
    PalState state{};
    state.size = sizeof state;
    EXPECT_EQ(pal_session_state(handle, &state), PAL_BAD_INPUT);
  }
}

TEST(CLibrary, FeelsTwoContextsAtOnce) {
  Opened first, second;
  open_ball(first, BallFrames());
  open_ball(second, BallFrames());
  HostHand left{first.session}, right{second.session};
  EXPECT_EQ(left.press(1.0), right.press(1.0));
  PAL_EXPECT_OK(pal_context_close(&first.context));
  PAL_EXPECT_OK(pal_scene_close(&first.scene));
  EXPECT_GT(left.at(0.018), 0.0) << "a session ends with its scene's handle";
  PAL_EXPECT_OK(pal_session_close(&first.session));
  EXPECT_GT(right.at(0.018), 0.0);
}

long resident_kb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmRSS:")) return std::stol(line.substr(6));
  return 0;
}

TEST(CLibrary, OpensAndClosesAThousandSessionsInTheSameMemory) {
  if (!ForbiddenCalls::can_watch()) GTEST_SKIP() << "A sanitizer keeps what is freed for a while.";
  Opened opened;
  open_ball(opened, BallFrames());
  const PalDeviceInfo device = host_device();
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_HOST_TICKS;
  info.host = &device;
  long after_some_kb = 0;
  for (int k = 0; k < 1000; ++k) {
    PalSession* session = nullptr;
    PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &session));
    HostHand hand{session};
    for (int t = 0; t < 3; ++t) hand.at(0.025);
    PAL_ASSERT_OK(pal_session_close(&session));
    if (k == 100) after_some_kb = resident_kb();
  }
  EXPECT_LT(resident_kb() - after_some_kb, 2000);
}

TEST(CLibrary, KeepsTheRealTimePromiseInAHostsLoop) {
  if (!ForbiddenCalls::can_watch())
    GTEST_SKIP() << "A sanitizer stands in front of the C library here.";
  Opened opened;
  open_ball(opened, BallFrames());
  HostHand hand{opened.session};
  hand.press(0.5);
  ForbiddenCalls::forget();
  ForbiddenCalls::count(true);
  ForbiddenCalls::watch_this_thread(true);
  double force_n[3];
  for (int k = 0; k < 4000; ++k) {
    const double z_m = k % 500 == 499 ? std::numeric_limits<double>::quiet_NaN()
                                      : 0.019 + 0.003 * std::sin(0.01 * k);
    const PalTick tick{{0.0, 0.0, z_m}, hand.time_ns += 1'000'000, 0};
    pal_haptics_tick(opened.session, &tick, force_n);
  }
  pal_haptics_tick(nullptr, nullptr, force_n);
  pal_session_at_rest(opened.session);
  ForbiddenCalls::watch_this_thread(false);
  EXPECT_EQ(ForbiddenCalls::counted(), 0) << ForbiddenCalls::first();
}

TEST(CLibrary, CanNotBeClosedFromItsOwnCallback) {
  // Two frames without motion, and no device for computing: no motion is estimated, so the callback
  // comes from the failing estimation.
  const PalContextInfo context = context_info(0);
  struct Heard {
    std::atomic<PalSession*> session{nullptr};
    std::atomic<int> closed{77}, stopped{77}, events{0};
    // Outlives the session, which may have more events.
  } heard;
  Opened opened;
  if (pal_context_open(&context, &opened.context) == PAL_NO_DEVICE)
    GTEST_SKIP() << pal_last_error();
  const BallFrames ball(2);
  const char* path = "ball";
  PalSceneInfo scene = scene_info(&path, 0, &ball.info);
  PAL_ASSERT_OK(pal_scene_open(opened.context, &scene, &opened.scene));
  const PalDeviceInfo device = host_device();
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_HOST_TICKS;
  info.host = &device;
  info.preset = "fast";
  info.user = &heard;
  info.on_event = [](void* user, PalEventKind, const char*) {
    auto* const self = static_cast<Heard*>(user);
    while (!self->session) ::usleep(1000);
    PalSession* handle = self->session;
    self->closed = pal_session_close(&handle);
    self->stopped = pal_session_stop(self->session);
    ++self->events;
  };
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
  heard.session = opened.session;
  for (int k = 0; k < 60000 && heard.events == 0; ++k) ::usleep(1000);
  ASSERT_GT(heard.events, 0);
  EXPECT_EQ(heard.closed, PAL_BAD_INPUT);
  EXPECT_EQ(heard.stopped, PAL_BAD_INPUT);
  // The first event may be that of a coarse motion.
  PalState state{};
  state.size = sizeof state;
  for (int k = 0; k < 60000 && (k == 0 || state.steps_known < state.steps); ++k) {
    PAL_ASSERT_OK(pal_session_state(opened.session, &state));
    ::usleep(1000);
  }
  EXPECT_EQ(state.steps_known, state.steps);
  EXPECT_EQ(state.can_play, 1U);
}

TEST(CLibrary, CanBeLoadedAndUnloaded) {
  // In a process of its own, because this one is linked with the library.
  for (int round = 0; round < 3; ++round)
    ASSERT_EQ(std::system(PALPATE_LOADER " " PALPATE_LIBRARY), 0) << "round " << round;
  const int with_device = std::system(PALPATE_LOADER " " PALPATE_LIBRARY " device");
  if (WEXITSTATUS(with_device) == 77) GTEST_SKIP() << "There is no Vulkan device here.";
  EXPECT_EQ(with_device, 0);
}

TEST(CLibrary, NamesItsResults) {
  for (int result = -8; result <= 2; ++result)
    EXPECT_THAT(pal_result_name(PalResult(result)), HasSubstr("PAL_")) << result;
  EXPECT_STREQ(pal_result_name(PalResult(5)), "no PalResult");
  EXPECT_EQ(pal_version(), PAL_VERSION);
}

}  // namespace
}  // namespace palpate::test
