// The messages between Haply's service and palpate. The oracle is the service's documents.
#include "integration/devices/haply_protocol.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

namespace palpate::devices::haply {
namespace {

using Json = nlohmann::json;

TEST(HaplyVersion, IsReadFromWhatTheServiceSays) {
  const Version version =
      version_of(R"({"git_hash":"1.2","git_tag":"3.5.0","project_version":"3.5.0.0"})");
  EXPECT_TRUE(version.known);
  EXPECT_EQ(version.major, 3);
  EXPECT_EQ(version.minor, 5);
  EXPECT_EQ(version_of(R"({"ok":true,"data":{"git_tag":"v3.1.1"}})").minor, 1) << "in an envelope";
  for (const char* body : {"", "3.1.0", "[]", "{}", R"({"git_tag":31})", R"({"git_tag":"main"})"})
    EXPECT_FALSE(version_of(body).known) << body;
}

TEST(HaplyVersion, SaysTheWordForAForce) {
  EXPECT_EQ(wording_of({3, 0, true}), Wording::kValues);
  EXPECT_EQ(wording_of({3, 1, true}), Wording::kValues);
  EXPECT_EQ(wording_of({3, 5, true}), Wording::kVector);
  EXPECT_EQ(wording_of({4, 0, true}), Wording::kVector);
  EXPECT_EQ(wording_of({}), Wording::kVector);
  EXPECT_FALSE(has_presets({3, 1, true}));
  EXPECT_TRUE(has_presets({3, 5, true}));
}

TEST(HaplyForce, IsInTheServicesAxesAndWords) {
  // x right, y away from the user, z up.
  const Json f = {{"x", 1.0}, {"y", -3.0}, {"z", 2.0}};
  const Json now = Json::parse(force_message("049D", {1.0, 2.0, 3.0}, Wording::kVector));
  EXPECT_EQ(now["inverse3"][0]["device_id"], "049D");
  EXPECT_EQ(now["inverse3"][0]["commands"]["set_cursor_force"]["vector"], f);
  const Json before = Json::parse(force_message("049D", {1.0, 2.0, 3.0}, Wording::kValues));
  EXPECT_EQ(before["inverse3"][0]["commands"]["set_cursor_force"]["values"], f);
}

const std::string kState = R"({"inverse3":[{"device_id":"049D","config":{"type":"minverse"},)"
                           R"("state":{"cursor_position":{"x":0.01,"y":-0.02,"z":0.03}},)"
                           R"("status":{"calibrated":true,"in_use":false,"ready":true}}],)"
                           R"("wireless_verse_grip":[{"state":{"buttons":{"a":false,"b":true}}}]})";

TEST(HaplyState, IsReadByTheLetter) {
  const auto state = state_of(kState);
  ASSERT_TRUE(state);
  ASSERT_EQ(state->devices.size(), 1U);
  const DeviceState& device = state->devices[0];
  EXPECT_EQ(device.id, "049D");
  EXPECT_EQ(device.type, "minverse");
  EXPECT_EQ(device.position_m, glm::dvec3(0.01, 0.03, 0.02));
  EXPECT_EQ(device.calibrated, true);
  EXPECT_EQ(device.in_use, false);
  EXPECT_FALSE(device.powered.has_value()) << "it does not report this";
  EXPECT_EQ(state->buttons, 2U);
}

TEST(HaplyEvents, AreThoseOfTheDocuments) {
  const auto safety = [](const char* type) {
    return event_of(Json{{"name", "device-safety-triggered"},
                         {"data", {{"device_id", "049D"}, {"safety_type", type}}}}
                        .dump());
  };
  EXPECT_EQ(safety("ebrake_triggered").event, Event::kBrakeOn);
  EXPECT_EQ(safety("ebrake_released").event, Event::kBrakeOff);
  EXPECT_EQ(safety("stall_detected").event, Event::kStalled);
  EXPECT_EQ(safety("stability_ceiling").event, Event::kOther);
  EXPECT_EQ(safety("stall_detected").id, "049D");
  EXPECT_EQ(event_of(R"({"name":"device-disconnected"})").event, Event::kDisconnected);
  EXPECT_EQ(event_of("no JSON").event, Event::kOther);
}

TEST(HaplyState, OfAnyBytesIsFiniteOrNothing) {
  std::mt19937 random(11);
  const std::string letters = "{}[]\":,0123456789eE.-truefalsenull \\u\xff";
  for (int round = 0; round < 20'000; ++round) {
    std::string text = kState;
    for (auto n = 1 + random() % 6; n > 0; --n) {
      const size_t at = random() % text.size();
      const char letter = letters[random() % letters.size()];
      if (random() % 3 == 0)
        text.erase(at, 1 + random() % 20);
      else if (random() % 2)
        text[at] = letter;
      else
        text.insert(at, 1, letter);
      if (text.empty()) text = "{";
    }
    const auto state = state_of(text);
    if (!state) continue;
    for (const DeviceState& device : state->devices) {
      if (!device.position_m) continue;
      const glm::dvec3 p = *device.position_m;
      ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) << text;
    }
    event_of(text);
    version_of(text);
  }
}

TEST(HaplyState, OfTextThatIsNestedWithoutEndIsNothing) {
  EXPECT_FALSE(state_of(std::string(60'000, '[')));
  EXPECT_FALSE(state_of(R"({"inverse3":)" + std::string(30'000, '[') + std::string(30'000, ']')));
  const auto nested =
      state_of(R"({"inverse3":[)" + std::string(20'000, '[') + std::string(20'000, ']') + "]}");
  ASSERT_TRUE(nested);
  EXPECT_FALSE(nested->devices.at(0).position_m);
}

}  // namespace
}  // namespace palpate::devices::haply
