// Every door takes the same options: the command line, the C library, Python and scene files. Each
// row of the table (integration/running/session_options.h) is tried below, in and above its range.
#include "integration/running/session_options.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "integration/app/session_flags.h"
#include "integration/files/scene/option_ranges.h"
#include "integration/running/open_session.h"
#include "tests/app/program.h"
#include "tests/toolkit/c_library.h"

namespace palpate::test {
namespace {

using files::NumberRange;
using running::SessionOption;
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
  /// Opens with a text of options, at the stage of the option.
  PalResult opens_with(const SessionOption& option, const std::string& text) {
    if (option.stage == running::OptionStage::kScene) {
      PalSceneInfo info{};
      info.options = text.c_str();
      return opens(info);
    }
    PalSessionInfo info{};
    info.options = text.c_str();
    return opens(info);
  }
  /// Opens a session of a scene from its text.
  PalResult opens_asking(const std::string& json) {
    PalSceneInfo info{};
    info.json = json.c_str();
    PalScene* const made = scene(info);
    if (!made) return result_;
    const PalDeviceInfo device = host_device();
    PalSessionInfo of_session{};
    of_session.size = sizeof of_session;
    of_session.flags = PAL_SESSION_HOST_TICKS;
    of_session.host = &device;
    PalSession* session = nullptr;
    const PalResult result = pal_session_open(made, &of_session, &session);
    pal_session_close(&session);
    PalScene* closing = made;
    pal_scene_close(&closing);
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

/// The same number in a field of a structure, for options that have one.
using InField = std::function<PalResult(double)>;

bool is_number(const SessionOption& option) {
  return running::type_of(option).ends_with("number");
}
bool is_whole(const SessionOption& option) {
  return running::type_of(option) == "whole number";
}
bool has(const SessionOption& option, running::Door door) {
  return (option.doors & door) != 0;
}

std::vector<double> allowed(const SessionOption& option) {
  const NumberRange& range = option.range;
  std::vector<double> values;
  // A value that the ball has, where there is no range.
  const double low = std::isfinite(range.low) ? range.low : 500.0;
  if (!range.above_low && low > 0.0) values.push_back(low);
  values.push_back(is_whole(option) ? low + 1.0
                                    : low + (std::isfinite(range.high) ? 0.01 * range.high : 1.0));
  if (std::isfinite(range.high)) values.push_back(range.high);
  return values;
}

std::vector<double> refused(const SessionOption& option) {
  const NumberRange& range = option.range;
  if (is_whole(option)) return {range.low - 1.0, range.high + 1.0};
  std::vector<double> values = {kNoNumber, kEndless, -kEndless};
  if (std::isfinite(range.low)) values.push_back(range.above_low ? range.low : range.low - 1.0);
  if (range.low > 0.0) values.push_back(0.5 * range.low);
  if (std::isfinite(range.high)) values.push_back(1.01 * range.high);
  return values;
}

std::string json_number(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : fmt::format("\"{}\"", value);
}

/// {"watchdog_s": 0.005}
std::string text_with(const SessionOption& option, const std::string& value) {
  return fmt::format(R"({{"{}": {}}})", option.key, value);
}

/// As Python has it, "watchdog_s=0.005".
std::string keyword(const SessionOption& option, const std::string& value) {
  return fmt::format("{}={}", option.key, value);
}
std::string python_number(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : fmt::format("float('{}')", value);
}

/// A scene of the ball that asks for an option itself.
std::string scene_asking(const SessionOption& option, const std::string& value) {
  return fmt::format(R"({{"session": {}, "volumes": [{{"name": "ball", "files": ["ball"]}}],
                         "modes": [{{"volume": "ball", "strength": {{"pairs": [[0, 0], [500, 4]]}}}}]}})",
                     text_with(option, value));
}

/// Two options are keys of a scene itself.
bool is_key_of_scenes(const SessionOption& option) {
  return option.key == "max_force_n" || option.key == "stiffness_n_per_m";
}
std::string scene_with(const SessionOption& option, double value) {
  return fmt::format(R"({{"{}": {}, "volumes": [{{"name": "ball", "files": ["ball"]}}],
                         "modes": [{{"volume": "ball", "strength": {{"pairs": [[0, 0], [500, 4]]}}}}]}})",
                     option.key, value);
}

/// What Python says to each keyword of Session: "" where it is taken.
std::map<std::string, std::string> python_says(const std::vector<std::string>& tried) {
  const files::TemporaryFolder folder;
  std::ofstream script(folder / "tried.py");
  script << "import numpy as np, palpate\n"
            "ball = np.zeros((8, 8, 8), np.float32)\nball[2:6, 2:6, 2:6] = 1000\n"
            "def tried(**more):\n"
            "    try:\n"
            "        palpate.Session(frames=ball, **{'estimate': False, **more}).close()\n"
            "        print('taken')\n"
            "    except (TypeError, ValueError) as error:\n"
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

/// A value of the wrong type or word, as JSON and as Python write it.
std::pair<std::string, std::string> wrong_value(const SessionOption& option) {
  const std::string_view type = running::type_of(option);
  if (type == "flag") return {"3", ""};  // everything is true or false in Python
  if (type == "paths" || type == "texts") return {"[1]", "[1]"};
  if (type == "word") return {"\"strong\"", "'strong'"};
  return {"[]", is_number(option) ? "'many'" : "3"};
}

TEST_F(Doors, TakeTheSameNumbers) {
  const std::map<std::string_view, InField> fields = {
      {"strength_n", field(&PalSceneInfo::strength_n)},
      {"friction", field(&PalSceneInfo::friction)},
      {"frames_per_second", field(&PalSceneInfo::frames_per_second)},
      {"width", field(&PalSceneInfo::width)},
      {"scale", field(&PalSceneInfo::scale)},
      {"wait_s", field(&PalSceneInfo::wait_s)},
      {"segments_frame", field(&PalSceneInfo::segments_frame)},
      {"max_force_n", field(&PalSessionInfo::max_force_n)},
      {"stiffness_n_per_m", field(&PalSessionInfo::stiffness_n_per_m)},
      {"watchdog_s", field(&PalSessionInfo::watchdog_s)},
      {"lets_go_s", field(&PalSessionInfo::lets_go_s)},
      {"serve", field(&PalSessionInfo::serve_port)}};
  std::vector<std::string> tried;
  for (const SessionOption& option : running::session_options())
    if (is_number(option) && has(option, running::kPythonDoor))
      for (const auto& values : {allowed(option), refused(option)})
        for (const double value : values) tried.push_back(keyword(option, python_number(value)));
  const auto says =
      *PALPATE_MODULE_PYTHON ? python_says(tried) : std::map<std::string, std::string>();

  for (const SessionOption& option : running::session_options()) {
    if (!is_number(option)) continue;
    // Ports and cores of this machine may be taken, and segments need a file: only what is outside
    // the range is tried at the other doors.
    const bool opens =
        option.key != "serve" && option.key != "core" && option.key != "segments_frame";
    const auto in_field = fields.find(option.key);
    const std::string flag = app::flag_of(option);
    const double per_unit = option.key == "watchdog_s" ? 1e3 : 1.0;
    const auto program = [&](double value) {
      return app::run({"feel", "/nowhere.mha", "--device", "simulated",
                       fmt::format("{}={}", flag, per_unit * value)});
    };
    for (const double value : allowed(option)) {
      SCOPED_TRACE(fmt::format("{} {}", option.key, value));
      running::SessionRequest request;
      EXPECT_TRUE(running::set_option(request, option, value));
      EXPECT_TRUE(request.given.contains(option.key));
      if (opens && has(option, running::kCDoor)) {
        PAL_EXPECT_OK(opens_with(option, text_with(option, json_number(value))));
        if (in_field != fields.end()) {
          PAL_EXPECT_OK(in_field->second(value));
        }
      }
      if (has(option, running::kProgramDoor) && option.key != "core") {
        EXPECT_THAT(program(value).err, HasSubstr("/nowhere.mha"));
      }
      const std::string python = keyword(option, python_number(value));
      if (opens && says.contains(python)) {
        EXPECT_EQ(says.at(python), "");
      }
      if (opens && has(option, running::kSceneFileDoor)) {
        PAL_EXPECT_OK(opens_asking(scene_asking(option, json_number(value))));
      }
      if (is_key_of_scenes(option)) {
        PAL_EXPECT_OK(opens_asking(scene_with(option, value)));
      }
    }
    const std::vector<double> outside = refused(option);
    for (size_t k = 0; k < outside.size(); ++k) {
      const double value = outside[k];
      SCOPED_TRACE(fmt::format("{} {}", option.key, value));
      const std::string sentence = files::out_of_range(option.key, value, option.range);
      if (has(option, running::kCDoor)) {
        EXPECT_EQ(opens_with(option, text_with(option, json_number(value))), PAL_BAD_INPUT);
        EXPECT_EQ(pal_last_error(), sentence);
      }
      // In a field 0 is the default, below 0 there is no friction, and counts are not negative.
      if (in_field != fields.end() && value != 0.0 &&
          !(option.key == "friction" && value < 0.0 && std::isfinite(value)) &&
          !(is_whole(option) && value < 0.0)) {
        EXPECT_EQ(in_field->second(value), PAL_BAD_INPUT);
        EXPECT_EQ(pal_last_error(), sentence);
      }
      const std::string python = keyword(option, python_number(value));
      // Python's 0 has meant the scene's own value, or none, since these keywords exist.
      const bool is_default =
          value == 0.0 && (option.key == "serve" || option.key == "max_force_n" ||
                           option.key == "stiffness_n_per_m");
      if (says.contains(python) && !is_default) {
        EXPECT_EQ(says.at(python), sentence);
      }
      // The last two are the ends of the range; command_line_test.cpp has the others.
      if (has(option, running::kProgramDoor) && k + 2 >= outside.size()) {
        const app::Outcome outcome = program(value);
        EXPECT_NE(outcome.exit_code, 0);
        EXPECT_THAT(outcome.err, Not(HasSubstr("/nowhere.mha")));
        if (!is_whole(option)) {
          const NumberRange shown =
              per_unit == 1.0 ? option.range : files::in_unit(option.range, per_unit, "ms");
          EXPECT_THAT(outcome.err, HasSubstr(files::text_of(shown)));
        }
      }
      if (std::isfinite(value) && is_key_of_scenes(option)) {
        EXPECT_EQ(opens_asking(scene_with(option, value)), PAL_BAD_INPUT);
        EXPECT_THAT(pal_last_error(), HasSubstr(files::text_of(option.range)));
      }
      if (has(option, running::kSceneFileDoor)) {
        EXPECT_EQ(opens_asking(scene_asking(option, json_number(value))), PAL_BAD_INPUT);
        EXPECT_EQ(pal_last_error(), "The scene's section session: " + sentence);
      }
    }
    // In a field 0 means the default, also where the range begins above it.
    if (in_field != fields.end()) {
      PAL_EXPECT_OK(in_field->second(0.0));
    }
  }
}

TEST_F(Doors, RefuseTheSameWrongTypesAndWords) {
  std::vector<std::string> tried;
  for (const SessionOption& option : running::session_options())
    if (has(option, running::kPythonDoor) && !wrong_value(option).second.empty())
      tried.push_back(keyword(option, wrong_value(option).second));
  const auto says =
      *PALPATE_MODULE_PYTHON ? python_says(tried) : std::map<std::string, std::string>();
  for (const SessionOption& option : running::session_options()) {
    SCOPED_TRACE(option.key);
    const auto [json, python] = wrong_value(option);
    running::SessionRequest request;
    const Status set = running::set_option(request, option, nlohmann::json::parse(json));
    ASSERT_FALSE(set);
    EXPECT_THAT(set.error().message, ::testing::StartsWith(std::string(option.key)));
    EXPECT_TRUE(request.given.empty());
    if (has(option, running::kCDoor)) {
      EXPECT_EQ(opens_with(option, text_with(option, json)), PAL_BAD_INPUT);
      EXPECT_EQ(pal_last_error(), set.error().message);
    }
    const std::string asked = keyword(option, python);
    if (says.contains(asked)) {
      EXPECT_THAT(says.at(asked), ::testing::StartsWith(std::string(option.key)));
    }
    if (has(option, running::kSceneFileDoor)) {
      EXPECT_EQ(opens_asking(scene_asking(option, json)), PAL_BAD_INPUT);
    } else if (option.stage == running::OptionStage::kSession) {
      EXPECT_EQ(opens_asking(scene_asking(option, json)), PAL_BAD_INPUT);
      EXPECT_THAT(pal_last_error(), HasSubstr(std::string(option.key) + " can not be set here"));
    }
    if (has(option, running::kProgramDoor) && running::type_of(option) == "word") {
      const app::Outcome outcome =
          app::run({"feel", "/nowhere.mha", app::flag_of(option) + "=strong"});
      EXPECT_NE(outcome.exit_code, 0);
      EXPECT_THAT(outcome.err, HasSubstr("'strong' is not known"));
    }
  }
}

TEST_F(Doors, NameTheNearestOption) {
  PalSessionInfo info{};
  info.options = R"({"watchdog": 1})";
  EXPECT_EQ(opens(info), PAL_BAD_INPUT);
  EXPECT_EQ(std::string(pal_last_error()),
            "There is no option 'watchdog': did you mean 'watchdog_s'?");
  info.options = R"({"strength_n": 1})";
  EXPECT_EQ(opens(info), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("is an option of the scene"));
  info.options = "[1]";
  EXPECT_EQ(opens(info), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("no JSON object"));
}

TEST_F(Doors, LetACallerOverruleWhatTheSceneAsksFor) {
  running::SessionRequest request;
  SceneSpec scene;
  scene.session = R"({"watchdog_s": 0.02, "preset": "fast"})";
  ASSERT_TRUE(running::set_option(request, "watchdog_s", 0.003));
  ASSERT_TRUE(running::set_scene_options(request, scene));
  EXPECT_EQ(request.watchdog_s, 0.003);
  EXPECT_EQ(request.preset, "fast");
}

TEST(SessionOptions, HaveOneNameOneSentenceAndAFieldThatIsThere) {
  std::ifstream header(std::string(PALPATE_SOURCE_DIR) + "/integration/toolkit/palpate.h");
  std::ostringstream text;
  text << header.rdbuf();
  std::set<std::string_view> keys;
  std::set<std::string> flags;
  for (const SessionOption& option : running::session_options()) {
    SCOPED_TRACE(option.key);
    EXPECT_TRUE(keys.insert(option.key).second);
    EXPECT_TRUE(flags.insert(app::flag_of(option)).second);
    EXPECT_FALSE(option.help.empty() || option.help.ends_with('.') ||
                 option.help.find("--") != std::string::npos);
    const std::string_view field = option.c_field.substr(option.c_field.find('.') + 1);
    if (!field.empty()) {
      EXPECT_THAT(text.str(), HasSubstr(std::string(field)));
    }
    // A default is a value of the option.
    running::SessionRequest request;
    if (is_number(option) && !option.fallback.empty() && option.words.empty()) {
      EXPECT_TRUE(running::set_option(request, option, nlohmann::json::parse(option.fallback)));
    } else if (running::type_of(option) == "word" && !option.fallback.empty()) {
      EXPECT_TRUE(running::set_option(request, option, option.fallback));
    }
  }
}

TEST(SessionOptions, StandInTheDocumentation) {
  std::ifstream page(std::string(PALPATE_SOURCE_DIR) + "/docs/using/options.md");
  std::ostringstream text;
  text << page.rdbuf();
  EXPECT_EQ(text.str(), app::options_page()) << "palpate write-manual writes the page anew";
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
