// Every door takes the same numbers: the command line, the C library, Python and scene files. Each
// option is tried below, in and above its range (integration/files/scene/option_ranges.h).
#include "integration/files/scene/option_ranges.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>

#include "tests/app/program.h"
#include "tests/toolkit/c_library.h"

namespace palpate::test {
namespace {

using files::NumberRange;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kEndless = std::numeric_limits<double>::infinity();

/// A ball in memory, felt without a device that computes.
class Doors : public ::testing::Test {
 protected:
  void SetUp() override {
    const PalContextInfo info = context_info();
    PAL_ASSERT_OK(pal_context_open(&info, &opened_.context));
    opened_.scene = scene(PalSceneInfo{});
    ASSERT_TRUE(opened_.scene) << pal_last_error();
  }
  PalScene* scene(PalSceneInfo info) {
    const char* const path = ball_.info.name;
    info.size = sizeof info;
    if (!info.json) {
      info.paths = &path;
      info.path_count = 1;
    }
    info.frames = &ball_.info;
    info.frame_sets = 1;
    PalScene* scene = nullptr;
    result_ = pal_scene_open(opened_.context, &info, &scene);
    return scene;
  }
  PalResult opens(const PalSceneInfo& info) {
    PalScene* made = scene(info);
    pal_scene_close(&made);
    return result_;
  }
  PalResult opens(PalSessionInfo info) {
    const PalDeviceInfo device = host_device();
    info.size = sizeof info;
    info.flags |= PAL_SESSION_HOST_TICKS;
    info.host = &device;
    PalSession* session = nullptr;
    const PalResult result = pal_session_open(opened_.scene, &info, &session);
    pal_session_close(&session);
    return result;
  }
  template <class Info, class Number>
  std::function<PalResult(double)> field(Number Info::*member) {
    return [this, member](double value) {
      Info info{};
      info.*member = Number(value);
      return opens(info);
    };
  }

  Opened opened_;
  BallFrames ball_;
  PalResult result_ = PAL_OK;
};

struct Option {
  const char* name;  ///< in palpate.h and in Python
  NumberRange range;
  std::function<PalResult(double)> in_c;
  const char* flag = nullptr;  ///< of the program
  double flag_per_unit = 1.0;
  const char* flag_unit = "";
  bool in_python = true;
  const char* json = nullptr;  ///< a key of a scene
  bool is_whole = false;       ///< a number of another kind can not be written
  bool opens = true;           ///< a value in the range has no other effect
  bool below_is_none = false;  ///< in C a number below 0 has a meaning
};

std::vector<double> allowed(const Option& option) {
  const NumberRange& range = option.range;
  std::vector<double> values;
  if (!range.above_low && range.low > 0.0) values.push_back(range.low);
  values.push_back(option.is_whole
                       ? range.low + 1.0
                       : range.low + (std::isfinite(range.high) ? 0.01 * range.high : 1.0));
  if (std::isfinite(range.high)) values.push_back(range.high);
  return values;
}

std::vector<double> refused(const Option& option) {
  const NumberRange& range = option.range;
  if (option.is_whole) return {range.high + 1.0};
  std::vector<double> values = {kNoNumber, kEndless, -kEndless, -1.0};
  if (range.low > 0.0) values.push_back(0.5 * range.low);
  if (std::isfinite(range.high)) values.push_back(1.01 * range.high);
  return values;
}

std::string python_number(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : fmt::format("float('{}')", value);
}

std::string scene_with(const char* key, double value) {
  return fmt::format(R"({{"{}": {}, "volumes": [{{"name": "ball", "files": ["ball"]}}],
                         "modes": [{{"volume": "ball", "strength": {{"pairs": [[0, 0], [500, 4]]}}}}]}})",
                     key, value);
}

/// As Python has it, "watchdog_s=0.005".
std::string keyword(const Option& option, double value) {
  return std::string(option.name) + "=" + python_number(value);
}

/// What Python says to each keyword of Session: "" where it is taken.
std::map<std::string, std::string> python_says(const std::vector<std::string>& tried) {
  const files::TemporaryFolder folder;
  std::ofstream script(folder / "tried.py");
  script << "import numpy as np, palpate\n"
            "ball = np.zeros((8, 8, 8), np.float32)\nball[2:6, 2:6, 2:6] = 1000\n"
            "def tried(**more):\n"
            "    try:\n"
            "        palpate.Session(frames=ball, estimate=False, **more).close()\n"
            "        print('taken')\n"
            "    except ValueError as error:\n"
            "        print('refused', error)\n";
  for (const std::string& one : tried) script << "tried(" << one << ")\n";
  script.close();
  const std::string command = std::string("PYTHONPATH=") + PALPATE_BUILD_DIR + "/python " +
                              PALPATE_MODULE_PYTHON + " " + (folder / "tried.py").string() + " > " +
                              (folder / "said").string();
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  std::ifstream said(folder / "said");
  std::map<std::string, std::string> all;
  std::string line;
  for (const std::string& one : tried) {
    EXPECT_TRUE(std::getline(said, line)) << one;
    all[one] = line == "taken" ? "" : line.substr(line.find(' ') + 1);
  }
  return all;
}

TEST_F(Doors, TakeTheSameNumbers) {
  std::vector<Option> options = {
      {"strength_n", files::kSurfaceStrengths_n, field(&PalSceneInfo::strength_n), "--strength"},
      {.name = "friction",
       .range = files::kFrictions,
       .in_c = field(&PalSceneInfo::friction),
       .flag = "--friction",
       .below_is_none = true},
      {"frames_per_second", files::kFrameRates, field(&PalSceneInfo::frames_per_second), "--fps"},
      {"width", files::kWidths, field(&PalSceneInfo::width), "--width"},
      {"scale", files::kScales, field(&PalSceneInfo::scale), "--scale"},
      {"wait_s", files::kWaits_s, field(&PalSceneInfo::wait_s)},
      {.name = "segments_frame",
       .range = files::kFrameNumbers,
       .in_c = field(&PalSceneInfo::segments_frame),
       .flag = "--segments-frame",
       .is_whole = true,
       .opens = false},
      {.name = "max_force_n",
       .range = files::kForces_n,
       .in_c = field(&PalSessionInfo::max_force_n),
       .flag = "--max-force",
       .json = "max_force_n"},
      {.name = "stiffness_n_per_m",
       .range = files::kStiffnesses_n_per_m,
       .in_c = field(&PalSessionInfo::stiffness_n_per_m),
       .flag = "--stiffness",
       .json = "stiffness_n_per_m"},
      {"watchdog_s", files::kWatchdogs_s, field(&PalSessionInfo::watchdog_s), "--watchdog", 1e3,
       "ms"},
      {"lets_go_s", files::kLettingGo_s, field(&PalSessionInfo::lets_go_s), "--lets-go"},
      {.name = "serve_port",
       .range = files::kPorts,
       .in_c = field(&PalSessionInfo::serve_port),
       .flag = "--serve",
       .in_python = false,
       .is_whole = true,
       .opens = false},
  };
  const bool has_python = *PALPATE_MODULE_PYTHON != '\0';
  std::vector<std::string> tried;
  for (const Option& option : options)
    for (const auto& values : {allowed(option), refused(option)})
      for (const double value : values)
        if (option.in_python) tried.push_back(keyword(option, value));
  const auto says = has_python ? python_says(tried) : std::map<std::string, std::string>();

  for (const Option& option : options) {
    const std::string range = files::text_of(option.range);
    const NumberRange flag_range =
        files::in_unit(option.range, option.flag_per_unit,
                       *option.flag_unit ? option.flag_unit : option.range.unit);
    const auto program = [&](double value) {
      return app::run({"feel", "/nowhere.mha", "--device", "simulated",
                       fmt::format("{}={}", option.flag, option.flag_per_unit * value)});
    };
    for (const double value : allowed(option)) {
      SCOPED_TRACE(fmt::format("{} {}", option.name, value));
      if (option.opens) {
        PAL_EXPECT_OK(option.in_c(value));
      }
      if (option.flag) {
        EXPECT_THAT(program(value).err, HasSubstr("/nowhere.mha"));
      }
      if (option.opens && says.contains(keyword(option, value))) {
        EXPECT_EQ(says.at(keyword(option, value)), "");
      }
      if (option.json) {
        const std::string json = scene_with(option.json, value);
        PalSceneInfo info{};
        info.json = json.c_str();
        PAL_EXPECT_OK(opens(info));
      }
    }
    const std::vector<double> outside = refused(option);
    for (size_t k = 0; k < outside.size(); ++k) {
      const double value = outside[k];
      SCOPED_TRACE(fmt::format("{} {}", option.name, value));
      const std::string sentence = files::out_of_range(option.name, value, option.range);
      const bool is_none = option.below_is_none && value < 0.0;
      if (!is_none) {
        EXPECT_EQ(option.in_c(value), PAL_BAD_INPUT);
        EXPECT_EQ(pal_last_error(), sentence);
      }
      if (says.contains(keyword(option, value))) {
        EXPECT_THAT(says.at(keyword(option, value)), HasSubstr(is_none ? "is expected" : sentence));
      }
      // The last two are the ends of the range; command_line_test.cpp has the others.
      if (option.flag && k + 2 >= outside.size()) {
        const app::Outcome outcome = program(value);
        EXPECT_NE(outcome.exit_code, 0);
        EXPECT_THAT(outcome.err, Not(HasSubstr("/nowhere.mha")));
        if (!option.is_whole) {
          EXPECT_THAT(outcome.err, HasSubstr(files::text_of(flag_range)));
        }
      }
      if (option.json && std::isfinite(value)) {
        const std::string json = scene_with(option.json, value);
        PalSceneInfo info{};
        info.json = json.c_str();
        EXPECT_EQ(opens(info), PAL_BAD_INPUT);
        EXPECT_THAT(pal_last_error(), HasSubstr(range));
      }
    }
    // 0 is the default in C, and no number of a person's where it is below the range.
    PAL_EXPECT_OK(option.in_c(0.0));
  }
}

TEST_F(Doors, GiveNumbersOutsideTheRangeAWord) {
  EXPECT_EQ(files::out_of_range("watchdog_s", 5.0, files::kWatchdogs_s),
            "watchdog_s is 5, but a number from 0.001 to 1 s is expected");
  EXPECT_EQ(files::text_of(files::in_unit(files::kWatchdogs_s, 1e3, "ms")),
            "a number from 1 to 1000 ms");
  EXPECT_EQ(files::text_of(files::kWidths), "a number above 0");
  EXPECT_EQ(files::text_of({0.0, kEndless, false, "s"}), "a number not below 0 s");
}

TEST_F(Doors, RefuseFlagsThatNobodyKnows) {
  constexpr uint32_t kAllBits = 0xffff;
  PalContextInfo of_context = context_info(kAllBits);
  PalContext* context = nullptr;
  EXPECT_EQ(pal_context_open(&of_context, &context), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("PalContextInfo.flags has bits that have no meaning"));
  PalSceneInfo of_scene{};
  of_scene.flags = 1U << 6;
  EXPECT_EQ(opens(of_scene), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("(0x40)"));
  PalSessionInfo of_session{};
  of_session.flags = kAllBits;
  EXPECT_EQ(opens(of_session), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("PalSessionInfo.flags"));
}

TEST_F(Doors, RefuseValuesThatAreNoNumbers) {
  for (const double value : {kNoNumber, kEndless}) {
    PalSceneInfo info{};
    info.iso_value = &value;
    EXPECT_EQ(opens(info), PAL_BAD_INPUT);
    EXPECT_THAT(pal_last_error(), HasSubstr("iso_value is"));
    ball_.info.times_s = &value;
    EXPECT_EQ(opens(PalSceneInfo{}), PAL_BAD_INPUT);
    ball_.info.times_s = nullptr;
  }
  // Axes of another length than 1 would be a second spacing.
  const double direction[9] = {2, 0, 0, 0, 1, 0, 0, 0, 1};
  std::copy(std::begin(direction), std::end(direction), ball_.info.grid.direction);
  EXPECT_EQ(opens(PalSceneInfo{}), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("a direction of length 2 along axis 0"));
  ball_.info.grid.direction[0] = 1.0;
  PAL_EXPECT_OK(opens(PalSceneInfo{}));
}

TEST_F(Doors, TakeTheSameGains) {
  const PalDeviceInfo device = host_device();
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_HOST_TICKS;
  info.host = &device;
  PAL_ASSERT_OK(pal_session_open(opened_.scene, &info, &opened_.session));
  for (const double gain : {files::kGains.low, 1.0, files::kGains.high})
    PAL_EXPECT_OK(pal_session_set_mode(opened_.session, 0, 1, gain));
  for (const double gain : {-1.0, 1.01 * files::kGains.high, kNoNumber, kEndless}) {
    EXPECT_EQ(pal_session_set_mode(opened_.session, 0, 1, gain), PAL_BAD_INPUT);
    EXPECT_THAT(pal_last_error(), HasSubstr("a number from 0 to 100 is expected"));
  }
}

}  // namespace
}  // namespace palpate::test
