// `palpate chart`, and choosing a setting by its measurements.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "integration/app/choice/motion_front.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/lab/tests/report/xml_check.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// The program stores its state in a folder of the test's own, and reads none of this machine's.
class ChartCommand : public testing::Test {
 protected:
  ChartCommand() { ::setenv("XDG_STATE_HOME", (state_ / "state").c_str(), 1); }
  ~ChartCommand() override { ::unsetenv("XDG_STATE_HOME"); }

  void keep(const MotionFront& front) const {
    std::filesystem::create_directories(state_ / "state/palpate");
    files::write_bytes(state_ / "state/palpate/motion_front.json", front_text(front));
  }
  static MotionFront front_on(const std::string& device) {
    return {device,
            "palpate",
            "a pair",
            size_t(kHeartSize) * kHeartSize * kHeartSize,
            {{"fast", 1.0, 0.2}, {"balanced", 2.0, 0.1}}};
  }

  TemporaryFolder state_;
};

/// Charts are made by palpate-lab; palpate chooses by them.
void expect_refused(const Outcome& result, const std::vector<std::string>& words,
                    const std::string& program = "palpate-lab") {
  EXPECT_EQ(result.exit_code, 2) << result.out;
  EXPECT_THAT(result.err, StartsWith(program + ": "));
  EXPECT_THAT(result.err, EndsWith(".\n"));
  for (const std::string& word : words) EXPECT_THAT(result.err, HasSubstr(word));
}

TEST_F(ChartCommand, SaysWhichNumbersAndWordsItTakes) {
  expect_refused(run({"chart", "--runs=0"}), {"from 1 to 100"});
  expect_refused(run({"chart", "--runs=101"}), {"from 1 to 100"});
  expect_refused(run({"chart", "--minutes=nan"}), {"from 0.1 to 10000"});
  expect_refused(run({"chart", "motoin"}), {"did you mean 'motion'?"});
  // Maps were a part of the charts in earlier versions.
  expect_refused(run({"chart", "stability", "--seed=-1"}), {"from 0 to 4294967295"});
  expect_refused(run({"chart", "stability", "--sed", "3"}),
                 {"'palpate-lab maps' has no option '--sed': did you mean '--seed'?"});
}

TEST_F(ChartCommand, OverwritesNoInput) {
  const TemporaryFolder folder;
  const Sequence heart = small_heart(2);
  const std::string a = written(heart.frames[0], folder / "a.mha");
  const std::string b = written(heart.frames[1], folder / "b.mha");
  const std::string truth = written(still_field(heart.frames[0].grid), folder / "u.mha");
  const std::string before = files::read_bytes(b), truth_before = files::read_bytes(truth);
  expect_refused(run({"chart", a, b, "--truth", truth, "--out", b}), {"b.mha"});
  expect_refused(run({"chart", a, b, "--truth", truth, "--out", truth}), {"u.mha"});
  EXPECT_EQ(files::read_bytes(b), before);
  EXPECT_EQ(files::read_bytes(truth), truth_before);
}

TEST_F(ChartCommand, RefusesFramesThatDoNotOverlap) {
  const TemporaryFolder folder;
  const Volume frame = small_heart(2).frames[0];
  Volume away = frame;
  away.grid.origin_mm.x += frame.grid.size.x * frame.grid.spacing_mm.x + 500.0;
  const std::string fixed = written(frame, folder / "fixed.mha");
  const std::string moving = written(away, folder / "moving.mha");
  const std::string field = written(still_field(frame.grid), folder / "u.mha");
  expect_refused(run({"chart", fixed, moving, "--truth", field, "--out", folder / "c.html"}),
                 {"fixed.mha", "moving.mha", "do not overlap", "500 mm apart"});
}

TEST_F(ChartCommand, RefusesWhatItCanNotChartBeforeItMeasures) {
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2).frames[0], folder / "heart.mha");
  const std::string out = folder / "r.html";
  expect_refused(run({"chart", "speed", "-o", out}),
                 {"no study 'speed'", "motion, feel, view, scene"});
  expect_refused(run({"chart", heart, "-o", out}), {"FIXED MOVING"});
  expect_refused(run({"chart", heart, heart, "-o", out}), {"--truth", "--landmarks"});
  expect_refused(
      run({"chart", heart, heart, "--truth", heart, "--landmarks", heart, heart, "-o", out}),
      {"one thing"});
  expect_refused(run({"chart", "--truth", heart, "-o", out}), {"name FIXED and MOVING"});
  expect_refused(run({"chart", "feel", heart, heart, "--truth", heart, "-o", out}), {"'motion'"});
  expect_refused(run({"chart", "feel", "-o", folder / "absent/r.html"}), {"absent"});
  EXPECT_EQ(folder.entry_count(), 1U);
}

TEST_F(ChartCommand, SaysWhatToInstallWhereMatplotlibIsMissing) {
  const TemporaryFolder folder;
  std::ofstream(folder / "matplotlib.py") << "raise ImportError\n";
  ::setenv("PYTHONPATH", folder.path().c_str(), 1);
  const Outcome result = run({"chart", "feel", "-o", folder / "r.html"});
  ::unsetenv("PYTHONPATH");
  expect_refused(result, {"apt-get install python3-matplotlib"});
}

TEST_F(ChartCommand, MakesAPageOfWhatIsFelt) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Outcome result =
      run({"chart", "feel", "--quick", "-o", folder / "r.html", "--csv", folder / "csv"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("a haptic frame takes"));
  // Without a terminal: a line for each step, and 100 % at the end.
  EXPECT_THAT(result.err, HasSubstr(" %  feel: transforms  "));
  EXPECT_THAT(result.err, HasSubstr(" left\n"));
  EXPECT_THAT(result.err, HasSubstr("100 %  feel: modes and volumes  "));
  const std::string page = files::read_bytes(folder / "r.html");
  EXPECT_EQ(test::xml_trouble(page), "");
  EXPECT_EQ(test::count_of("<svg", page), 3U);
  EXPECT_THAT(files::read_bytes(folder / "csv/feel-one-haptic-frame-and-its-force.csv"),
              StartsWith("family,setting,median_us"));
}

TEST_F(ChartCommand, StopsAtCtrlCWithoutATrace) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  for (const char* study : {"scene", "motion"}) {
    Program program({"chart", study, "--quick", "-o", folder / "r.html"});
    ASSERT_TRUE(program.wait_for("Device"));
    program.signal(SIGINT);
    const Outcome stopped = program.wait();
    EXPECT_EQ(stopped.exit_code, 1);
    EXPECT_THAT(stopped.err, HasSubstr("no report was written"));
    EXPECT_EQ(folder.entry_count(), 0U);
  }
}

TEST_F(ChartCommand, ChoosesByWhatThisDeviceMeasured) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart(2);
  const std::string fixed = written(heart.frames[0], folder / "f.mha"),
                    moving = written(heart.frames[1], folder / "m.mha");
  const auto chosen = [&](const std::string& wish, const std::string& value) {
    return run({"motion", fixed, moving, "-o", folder / "u.mha", wish, value});
  };
  expect_refused(chosen("--within", "2s"), {"palpate chart motion --quick"}, "palpate");
  keep(front_on("another device"));
  const Outcome other = chosen("--within", "2s");
  expect_refused(other, {"of another device (another device)"}, "palpate");
  // The sentence names this machine's device.
  const size_t name = other.err.find("--quick' on ") + 12, end = other.err.find(" once,");
  ASSERT_LT(name, end);
  keep(front_on(other.err.substr(name, end - name)));
  EXPECT_THAT(chosen("--within", "1.5s").out, HasSubstr("Chosen    fast for at most 1.5 s"));
  EXPECT_THAT(chosen("--within", "3000ms").out, HasSubstr("Chosen    balanced for at most 3 s"));
  // 128 mm of 48 voxels: 2.67 mm each, so balanced has an error of 0.27 mm and fast twice that.
  EXPECT_THAT(chosen("--error", "0.3mm").out, HasSubstr("Chosen    balanced for at most 0.3 mm"));
  EXPECT_THAT(chosen("--error", "1").out, HasSubstr("Chosen    fast for at most 1 mm"));
  expect_refused(chosen("--within", "10ms"), {"the fastest, fast, takes about 1 s"}, "palpate");
  expect_refused(chosen("--error", "1um"), {"the most accurate, balanced"}, "palpate");
}

TEST_F(ChartCommand, SaysThatItIsLateAndTriesTheNextBetterSetting) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart(2);
  const std::string fixed = written(heart.frames[0], folder / "f.mha"),
                    moving = written(heart.frames[1], folder / "m.mha");
  Volume empty = heart.frames[1];
  for (float& value : empty.values) value = 0.0F;
  const std::string nothing = written(empty, folder / "e.mha");
  const auto chosen = [&](const std::string& other, const std::string& wish,
                          const std::string& value) {
    return run({"motion", fixed, other, "-o", folder / "u.mha", wish, value});
  };
  keep(front_on("another device"));
  const Outcome other = chosen(moving, "--within", "2s");
  const size_t name = other.err.find("--quick' on ") + 12, end = other.err.find(" once,");
  ASSERT_LT(name, end);
  MotionFront front = front_on(other.err.substr(name, end - name));
  keep(front);
  const Outcome bad = chosen(nothing, "--error", "1mm");
  EXPECT_EQ(bad.exit_code, 4);
  EXPECT_THAT(bad.out, testing::ContainsRegex("Chosen    fast[^$]*Verdict   failed[^$]*"
                                              "Chosen    balanced[^$]*Wrote[^$]*Verdict   failed"));
  const Outcome good = chosen(moving, "--error", "1mm");
  EXPECT_EQ(good.exit_code, 0);
  EXPECT_THAT(good.out, testing::Not(HasSubstr("Chosen    balanced")));
  EXPECT_THAT(good.out, testing::Not(HasSubstr("Late ")));
  // A front from a machine that is a million times as fast.
  front.points = {{"fast", 1e-6, 0.2}};
  keep(front);
  EXPECT_THAT(chosen(moving, "--within", "1ms").out,
              testing::ContainsRegex("Late      a pair took .* s, not the 0.001 s asked for"));
}

TEST_F(ChartCommand, RefusesWishesThatAreNoneOrContradict) {
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2).frames[0], folder / "f.mha");
  const auto with = [&](std::vector<std::string> more) {
    std::vector<std::string> all{"motion", heart, heart, "-o", folder / "u.mha"};
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
  };
  for (const char* text : {"soon", "-1s", "0", "2 hours", "2mm", "nan", "inf", "1e999"})
    expect_refused(with({"--within", text}), {"can not be understood", "2s or 500ms"}, "palpate");
  for (const char* text : {"small", "0mm", "3s", "-1"})
    expect_refused(with({"--error", text}), {"can not be understood", "0.5mm"}, "palpate");
  EXPECT_EQ(with({"--within", "2s", "--error", "1mm"}).exit_code, 2);
  EXPECT_EQ(with({"--within", "2s", "--preset", "fast"}).exit_code, 2);
  EXPECT_THAT(with({"--within", "2s", "--preset", "fast"}).err,
              HasSubstr("can not be used together with --within"));
  EXPECT_EQ(with({"--error", "1mm", "--levels", "2"}).exit_code, 2);
}

}  // namespace
}  // namespace palpate::app
