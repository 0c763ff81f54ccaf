// Faults that are likely with a Haply device in contact, one row per fault, on the whole path: real
// sockets, the WebSocket, MailboxDevice, the servo loop, the haptic step, the guards. The oracle is
// the emulated service, which stores the last force.
#include <gtest/gtest.h>

#include "integration/devices/answer_judge.h"
#include "integration/devices/haply.h"
#include "tests/devices/emulated_haply.h"
#include "tests/devices/fault_rows.h"
#include "tests/devices/mailbox_rig.h"

namespace palpate::devices::test {
namespace {

class HaplyRig final : public MailboxRig {
 public:
  struct Options {
    EmulatedHaply::Options service;
    MailboxOptions mailbox = patient_mailbox();
    int64_t answer_wait_ns = 250'000'000;
    bool events = true;
  };
  static Options patient() { return {}; }

  explicit HaplyRig(const Options& options) : service(options.service) {
    HaplyOptions haply;
    haply.host = "127.0.0.1";
    haply.port = service.port();
    haply.events_port = options.events ? service.events_port() : 0;
    haply.answer_wait_ns = options.answer_wait_ns;
    hold(service, glm::dvec3(0.0));
    // An old service's grip has to be in the middle at first.
    service.place(glm::dvec3(0.0));
    start_mailbox(make_haply_link(haply), options.mailbox);
  }

  void fault(const std::function<void(EmulatedHaply::Faults&)>& change) {
    service.change_faults(change);
  }

  EmulatedHaply service;
};

using Rig = HaplyRig;
using Row = FaultRow<Rig>;
using Faults = EmulatedHaply::Faults;
using Json = nlohmann::json;

/// For faults that end in opening it again, after 100 missing answers. Still longer than a busy
/// machine takes to run the service's thread.
Rig::Options less_patient() {
  Rig::Options options = Rig::patient();
  options.answer_wait_ns = 100'000'000;
  return options;
}

Rig::Options of_version(const char* version) {
  Rig::Options options = Rig::patient();
  options.service.version = version;
  return options;
}

std::function<void(Rig&)> set(const std::function<void(Faults&)>& change) {
  return [change](Rig& rig) { rig.fault(change); };
}

void heal(Rig& rig) {
  rig.service.set({});
}

std::function<void(Rig&)> mangle(const std::function<std::string(std::string)>& how) {
  return set([how](Faults& faults) { faults.mangle = how; });
}

std::function<void(Rig&)> mangle_some(int count,
                                      const std::function<std::string(std::string)>& how) {
  return set([count, how](Faults& faults) {
    faults.mangle = [left = count, how](std::string text) mutable {
      return left-- > 0 ? how(std::move(text)) : text;
    };
  });
}

std::string noise(const std::string& text) {
  std::string other = text;
  for (size_t n = 0; n < other.size(); ++n) other[n] = char('!' + n * 7 % 90);
  return other;
}

/// The cursor at another place, in the service's axes.
std::function<std::string(std::string)> shifted(double by_m) {
  return [by_m](const std::string& text) {
    Json json = Json::parse(text);
    Json& x = json["inverse3"][0]["state"]["cursor_position"]["x"];
    x = x.get<double>() + by_m;
    return json.dump();
  };
}

/// The cursor's x as any text.
std::function<std::string(std::string)> with_x(const std::string& x) {
  return [x](const std::string& text) {
    Json json = Json::parse(text);
    json["inverse3"][0]["state"]["cursor_position"]["x"] = "HERE";
    std::string out = json.dump();
    out.replace(out.find("\"HERE\""), 6, x);
    return out;
  };
}

std::function<void(Rig&)> event(const char* name, const char* safety_type = nullptr) {
  return [name, safety_type](Rig& rig) {
    Json data = {{"device_family", "inverse"}, {"device_id", "049D"}};
    if (safety_type) data["safety_type"] = safety_type;
    rig.service.tell({{"name", name}, {"category", "device"}, {"data", data}});
  };
}

std::function<void(Rig&)> change(const std::function<void(EmulatedHaply::Options&)>& how) {
  return [how](Rig& rig) { rig.service.change(how); };
}

void stop_service(Rig& rig) {
  rig.watched->lose();
  rig.service.stop_service();
}

void start_service(Rig& rig) {
  rig.service.start_service();
  rig.find(rig.service);
}

std::vector<Row> rows() {
  return {
      // The cable, and the service.
      {.name = "TheServiceEnds",
       .inject = stop_service,
       .fault = DeviceFault::kUnplugged,
       .recover = start_service},
      {.name = "TheServiceStartsAgainAtOnce",
       .inject =
           [](Rig& rig) {
             stop_service(rig);
             start_service(rig);
           },
       .fault = DeviceFault::kUnplugged},
      {.name = "TheDeviceIsUnplugged",
       .inject = change([](auto& options) { options.connected = false; }),
       .fault = DeviceFault::kUnplugged,
       .recover = change([](auto& options) { options.connected = true; })},
      {.name = "TheDeviceIsUnpluggedAndAnEventSaysSo",
       .inject = event("device-disconnected"),
       .fault = DeviceFault::kUnplugged},
      {.name = "ComesBackInUseByAnotherSession",
       .inject = change([](auto& options) {
         options.connected = false;
         options.in_use = true;
       }),
       .fault = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             rig.service.change([](auto& options) { options.connected = true; });
             EXPECT_TRUE(rig.turn_until(
                 [&] { return rig.inputs.back().reading.fault == DeviceFault::kBusy; }));
             rig.service.change([](auto& options) { options.in_use = false; });
           }},
      // Messages of the service.
      {.name = "TheCalibrationIsLost",
       .inject = change([](auto& options) { options.calibrated = false; }),
       .fault = DeviceFault::kNotHomed,
       .recover = change([](auto& options) { options.calibrated = true; })},
      {.name = "ThePowerSupplyIsPulled",
       .inject = change([](auto& options) { options.powered = false; }),
       .fault = DeviceFault::kStarting,
       .recover = change([](auto& options) { options.powered = true; })},
      {.name = "ItIsNotReadyAnyMore",
       .inject = change([](auto& options) { options.ready = false; }),
       .fault = DeviceFault::kStarting,
       .recover = change([](auto& options) { options.ready = true; })},
      {.name = "TheBrakeTakesHold",
       .inject = event("device-safety-triggered", "ebrake_triggered"),
       .fault = DeviceFault::kForceOff,
       .recover =
           [](Rig& rig) {
             rig.run_periods(100);
             EXPECT_EQ(rig.inputs.back().reading.fault, DeviceFault::kForceOff)
                 << "until the brake is released";
             event("device-safety-triggered", "ebrake_released")(rig);
           }},
      {.name = "TheBrakeTakesHoldAndTheEventsBreakOffMeanwhile",
       .inject = event("device-safety-triggered", "ebrake_triggered"),
       .fault = DeviceFault::kForceOff,
       .recover =
           [](Rig& rig) {
             const size_t before = rig.service.listeners();
             rig.service.drop_listeners();
             EXPECT_TRUE(rig.turn_until([&] { return rig.service.listeners() > before; }));
             EXPECT_EQ(rig.inputs.back().reading.fault, DeviceFault::kForceOff)
                 << "until an event reports that the brake is released";
             event("device-safety-triggered", "ebrake_released")(rig);
           },
       .after = [](Rig& rig) { EXPECT_EQ(rig.device->counts().opened, 1U); }},
      {.name = "NobodyHearsThatTheBrakeLetsGoUntilItDoesOnceMore",
       .inject = event("device-safety-triggered", "ebrake_triggered"),
       .fault = DeviceFault::kForceOff,
       .recover =
           [](Rig& rig) {
             // The brake is released while there is no listener, so no event arrives.
             const size_t before = rig.service.listeners();
             rig.service.drop_listeners();
             EXPECT_TRUE(rig.turn_until([&] { return rig.service.listeners() > before; }));
             rig.run_periods(200);
             EXPECT_EQ(rig.inputs.back().reading.fault, DeviceFault::kForceOff);
             event("device-safety-triggered", "ebrake_triggered")(rig);
             rig.run_periods(20);
             EXPECT_EQ(rig.inputs.back().reading.fault, DeviceFault::kForceOff);
             event("device-safety-triggered", "ebrake_released")(rig);
           }},
      {.name = "NobodyHearsThatTheBrakeLetsGoUntilItIsUnplugged",
       .inject = event("device-safety-triggered", "ebrake_triggered"),
       .fault = DeviceFault::kForceOff,
       .recover =
           [](Rig& rig) {
             rig.service.drop_listeners();
             rig.service.change([](auto& options) { options.connected = false; });
             EXPECT_TRUE(rig.turn_until(
                 [&] { return rig.inputs.back().reading.fault == DeviceFault::kUnplugged; }));
             rig.service.change([](auto& options) { options.connected = true; });
           },
       .after = [](Rig& rig) { EXPECT_EQ(rig.device->counts().opened, 2U); }},
      {.name = "TheEventsBreakOff",
       .inject =
           [](Rig& rig) {
             const size_t before = rig.service.listeners();
             rig.service.drop_listeners();
             EXPECT_TRUE(rig.turn_until([&] { return rig.service.listeners() > before; }));
           },
       .ends = Ends::kTolerated},
      {.name = "AMotorStalls",
       .inject = event("device-safety-triggered", "stall_detected"),
       .fault = DeviceFault::kStuck},
      {.name = "AnotherSessionTakesIt",
       .inject = event("device-busy"),
       .fault = DeviceFault::kBusy},
      {.name = "AnEventIsOfAnotherDevice",
       .inject =
           [](Rig& rig) {
             rig.service.tell({{"name", "device-disconnected"}, {"data", {{"device_id", "0001"}}}});
           },
       .ends = Ends::kTolerated},
      {.name = "EventsMakeNoSense",
       .inject =
           [](Rig& rig) {
             rig.service.tell(Json::array({1, "two"}));
             rig.service.tell({{"name", 3}, {"data", "nothing"}});
           },
       .ends = Ends::kTolerated},
      // Missing, late and invalid answers.
      {.name = "FallsSilent",
       .inject = set([](Faults& faults) { faults.silent = true; }),
       .fault = DeviceFault::kTimeout,
       .recover = heal,
       .options = less_patient()},
      {.name = "FallsSilentUntilItIsOpenedAgain",
       .inject = set([](Faults& faults) { faults.silent = true; }),
       .fault = DeviceFault::kTimeout,
       .recover =
           [](Rig& rig) {
             EXPECT_TRUE(rig.turn_until(
                 [&] { return rig.device->counts().missed >= AnswerJudge::kGiveUp; }));
             heal(rig);
           },
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().opened, 2U); },
       .options = less_patient()},
      {.name = "AnswersAreLate",
       .inject = set([](Faults& faults) { faults.delay_ns = 300'000'000; }),
       .fault = DeviceFault::kTimeout,
       .within = 0,
       .recover = heal,
       .options = less_patient()},
      {.name = "EveryAnswerIsNoise",
       .inject = mangle(noise),
       .fault = DeviceFault::kGarbage,
       .recover = heal},
      {.name = "OneAnswerIsNoise", .inject = mangle_some(1, noise), .ends = Ends::kTolerated},
      {.name = "ThreeAnswersAreNoise",
       .inject = mangle_some(3, noise),
       .fault = DeviceFault::kGarbage},
      {.name = "EveryAnswerIsHalf",
       .inject = mangle([](std::string text) { return text.substr(0, text.size() / 2); }),
       .fault = DeviceFault::kGarbage,
       .recover = heal},
      {.name = "ThePositionIsTooLargeForANumber",
       .inject = mangle(with_x("1e999")),
       .fault = DeviceFault::kGarbage,
       .recover = heal},
      {.name = "ThePositionIsNull",
       .inject = mangle(with_x("null")),
       .fault = DeviceFault::kGarbage,
       .recover = heal},
      {.name = "AnswersComeInFragments",
       .inject = set([](Faults& faults) { faults.fragment = 16; }),
       .ends = Ends::kTolerated},
      {.name = "AnswersComeInPiecesOfAFewBytes",
       .inject = set([](Faults& faults) { faults.torn = 64; }),
       .ends = Ends::kTolerated},
      {.name = "PingsComeBetween",
       .inject = set([](Faults& faults) { faults.pings = true; }),
       .ends = Ends::kTolerated},
      {.name = "EveryAnswerComesTwice",
       .inject = set([](Faults& faults) { faults.copies = 2; }),
       .ends = Ends::kTolerated},
      {.name = "AnswersFloodIn",
       .inject = set([](Faults& faults) { faults.copies = 300; }),
       .fault = DeviceFault::kGarbage,
       .within = 0,
       .recover = heal},
      {.name = "AnswersAreLargerThanAnyState",
       .inject = mangle([](const std::string& text) { return text + std::string(200'000, ' '); }),
       .fault = DeviceFault::kGarbage,
       .recover = heal},
      {.name = "AFrameSaysThatItIsHuge",
       .inject = set([](Faults& faults) {
         faults.raw = std::string("\x81\x7f\x7f\xff\xff\xff\xff\xff\xff\xff", 10);
       }),
       .fault = DeviceFault::kGarbage,
       .recover = heal},
      {.name = "FramesBreakTheRules",
       .inject = set([](Faults& faults) { faults.raw = std::string("\xf3\x05hello", 7); }),
       .fault = DeviceFault::kUnplugged,
       .recover = heal},
      // Positions.
      {.name = "ThePositionJumps",
       .inject = mangle(shifted(0.02)),
       .fault = DeviceFault::kJumped,
       .recover = heal},
      {.name = "ThePositionJumpsForOneAnswer",
       .inject = mangle_some(1, shifted(-0.02)),
       .fault = DeviceFault::kJumped},
      {.name = "ThePositionStands",
       .inject = [](Rig& rig) { rig.holds_grip = false; },
       .fault = DeviceFault::kStuck,
       .within = 0,
       .recover = [](Rig& rig) { rig.holds_grip = true; }},
      // The host.
      {.name = "TheHostIsAwayAndTheForceIsCutMeanwhile",
       .inject = [](Rig& rig) { rig.stall_host(500, [&] { return !rig.pushes(); }); },
       .fault = DeviceFault::kTimeout,
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().cuts, 1U); },
       .options =
           [] {
             Rig::Options options = Rig::patient();
             options.mailbox.away_ns = 200'000'000;
             return options;
           }()},
      // Other services.
      {.name = "AnOldServiceEnds",
       .inject = stop_service,
       .fault = DeviceFault::kUnplugged,
       .recover = start_service,
       .options = of_version("3.1.0")},
      {.name = "AServiceWithoutPresetsFallsSilent",
       .inject = mangle_some(3, [](const std::string&) { return std::string(); }),
       .fault = DeviceFault::kGarbage,
       .options = of_version("3.3.2")},
  };
}

class HaplyFault : public testing::TestWithParam<Row> {};

TEST_P(HaplyFault, BringsTheForceDownAndLetsItComeBack) {
  Rig rig(GetParam().options);
  expect_row(rig, GetParam());
  for (const std::string& rule : rig.service.broken_rules()) ADD_FAILURE() << rule;
}

INSTANTIATE_TEST_SUITE_P(, HaplyFault, testing::ValuesIn(rows()), name_of_row<Rig>);
INSTANTIATE_TEST_SUITE_P(AroundIt, HaplyFault, testing::ValuesIn(host_and_scene_rows<Rig>()),
                         name_of_row<Rig>);

}  // namespace
}  // namespace palpate::devices::test
