// The description of a run in a recording: read as it was written, and refused if damaged.
#include "integration/loading/replay_key.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "module/scene/built_in.h"
#include "tests/app/fuzz/replay_key_bytes.h"
#include "tests/support/mutator.h"

namespace palpate::app {
namespace {

using loading::parse_replay_key;
using loading::ReplayKey;

using testing::HasSubstr;

ReplayKey made_key() {
  ReplayKey key;
  key.scene = shell_scene();
  key.device.max_force_n = 9.0;
  key.device.max_stiffness_n_per_m = 1234.5;
  key.device.workspace_centre_m = {0.01, -0.02, 0.125};
  key.device.workspace_radius_m = 0.05;
  key.device.delay_s = 0.0005;
  key.safety.max_force_n = 3.0;
  key.safety.max_speed_m_per_s = 0.75;
  key.safety.late_s = 0.05;
  key.safety.stale_s = 0.1;
  key.safety.dead_man = true;
  key.safety.dead_man_buttons = 0xfffffffe;
  key.safety.shown_buttons = 0x80000000;
  key.tube_buttons = 0x5;
  return key;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what << " in " << text;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

TEST(ReplayKey, IsReadBackAsItWasWritten) {
  const ReplayKey key = made_key();
  const auto read = parse_replay_key("a.ticks", text_of(key));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(text_of(*read), text_of(key));
  EXPECT_EQ(read->device.max_stiffness_n_per_m, 1234.5);
  EXPECT_EQ(read->device.workspace_centre_m, glm::dvec3(0.01, -0.02, 0.125));
  EXPECT_EQ(read->safety.max_speed_m_per_s, 0.75);
  EXPECT_EQ(read->safety.late_s, 0.05);
  EXPECT_TRUE(read->safety.dead_man);
  EXPECT_EQ(read->safety.dead_man_buttons, 0xfffffffe);
  EXPECT_EQ(read->safety.shown_buttons, 0x80000000);
  EXPECT_EQ(read->tube_buttons, 0x5U);
  EXPECT_EQ(read->scene.volumes.size(), shell_scene().volumes.size());
}

TEST(ReplayKey, OfTheTimeBeforeTheHandsSpeedCouldBeChosenHasTheDefault) {
  const auto read =
      parse_replay_key("a.ticks", replaced(text_of(made_key()), ",\"max_speed_m_per_s\":0.75", ""));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->safety.max_speed_m_per_s, SafetyOptions{}.max_speed_m_per_s);
}

TEST(ReplayKey, OfTheTimeBeforeHeadsetsIsReadAsOfARunThatNobodyHadToSee) {
  std::string text = replaced(text_of(made_key()), ",\"seen_buttons\":2147483648", "");
  text = replaced(text, ",\"dead_man_buttons\":4294967294", "");
  const auto read = parse_replay_key("a.ticks", text);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->safety.shown_buttons, 0u);
  EXPECT_EQ(read->safety.dead_man_buttons, ~0u) << "any button";
  EXPECT_TRUE(read->safety.dead_man) << "the rest is as it was";
}

TEST(ReplayKey, OfTheTimeBeforeHostsIsReadWithTheProgramsTubeButtons) {
  const std::string text = replaced(text_of(made_key()), ",\"tube_buttons\":5", "");
  const auto read = parse_replay_key("a.ticks", text);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->tube_buttons, 0U) << "each button is the dead-man switch";
  const auto free =
      parse_replay_key("a.ticks", replaced(text, "\"dead_man\":true", "\"dead_man\":false"));
  ASSERT_TRUE(free) << free.error().message;
  EXPECT_EQ(free->tube_buttons, 0x3fffffffU) << "all but the two that stand for a headset";
}

TEST(ReplayKey, RefusesWhatPalpateNeverWrites) {
  const std::string text = text_of(made_key());
  for (const auto& [what, by] : std::vector<std::pair<std::string, std::string>>{
           {"\"late_s\":0.05", "\"late_s\":-0.05"},
           {"\"max_speed_m_per_s\":0.75", "\"max_speed_m_per_s\":\"fast\""},
           {"\"late_s\":0.05", "\"late_s\":null"},
           {"\"late_s\":0.05", "\"late_s\":\"soon\""},
           {"\"late_s\":0.05", "\"late_s\":1e999"},
           {"\"max_force_n\":9.0", "\"max_force_n\":-9.0"},
           {"\"dead_man\":true", "\"dead_man\":1"},
           {"4294967294", "4294967296"},
           {"4294967294", "-1"},
           {"4294967294", "1e300"},
           {"0.01,-0.02,0.125", "0.01,-0.02"},
           {"\"device\"", "\"devices\""}}) {
    const auto read = parse_replay_key("a.ticks", replaced(text, what, by));
    ASSERT_FALSE(read) << by;
    EXPECT_THAT(read.error().message, HasSubstr("a.ticks")) << by;
  }
  EXPECT_THAT(parse_replay_key("a.ticks", "").error().message,
              HasSubstr("was not made by 'palpate feel'"));
}

TEST(ReplayKeyFuzz, ReaderHolds) {
  test::Mutator mutator({"-1", "0", "1e308", "null", "true", "[]", "{}", "\"", ",", "4294967296",
                         "-0.0", "1e300", "\xff"});
  mutator.run(text_of(made_key()), 4000, fuzz::parse_replay_key_bytes);
}

}  // namespace
}  // namespace palpate::app
