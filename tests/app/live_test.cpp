// palpate feel and view of a live source: the program, and a server that does not use the project's
// OpenIGTLink code.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <regex>
#include <thread>

#include "integration/openigtlink/client.h"
#include "integration/openigtlink/socket.h"
#include "tests/app/program.h"
#include "tests/app/ticks.h"
#include "tests/openigtlink/wire.h"

namespace palpate::app {
namespace {

using namespace std::chrono_literals;

/// A ball of 32^3 samples, 3 mm apart, whose radius changes.
test::Raw ball(int frame) {
  test::WireImage image;
  image.scalar_type = 5;
  image.size = image.part = {32, 32, 32};
  image.matrix = {3, 0, 0, 0, 3, 0, 0, 0, 3, 0, 0, 0};
  const double radius = 9.0 + std::sin(0.7 * frame + 0.02 * frame * frame);
  for (int k = 0; k < 32; ++k)
    for (int j = 0; j < 32; ++j)
      for (int i = 0; i < 32; ++i) {
        const double r = std::hypot(i - 15.5, j - 15.5, k - 15.5);
        const auto value = uint16_t(1000.0 / (1.0 + std::exp(r - radius)));
        image.samples.push_back(uint8_t(value));
        image.samples.push_back(uint8_t(value >> 8));
      }
  test::WireHeader header;
  header.seconds = uint32_t(100 + frame);
  return test::wire_message(header, image.body());
}

/// A table that moves 1 mm to the right with each frame, and from frame 20 on is far away.
test::Raw table(size_t frame) {
  test::Raw body;
  const float way_mm = float(frame) + (frame >= 20 ? 500.0F : 0.0F);
  for (const float f : {1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, way_mm, 0.F, 0.F})
    test::put_float(body, f);
  test::WireHeader header;
  header.type = "TRANSFORM";
  header.device = "Table";
  return test::wire_message(header, body);
}

/// Sends frames to a client, ten per second, until the object's end. Closes the connection once, in
/// the middle of a message, after `hangs_up_after` frames if this is not 0.
class Source {
 public:
  explicit Source(size_t hangs_up_after = 0) {
    for (int k = 0; k < 12; ++k) frames_.push_back(ball(k));
    thread_ = std::jthread([this, hangs_up_after](std::stop_token stop) mutable {
      while (!stop.stop_requested()) {
        if (!server_.accept_one(100)) continue;
        for (size_t k = 0; !stop.stop_requested(); ++k) {
          test::Raw frame = frames_[k % frames_.size()];
          frame[34] = uint8_t(k >> 24), frame[35] = uint8_t(k >> 16);
          frame[36] = uint8_t(k >> 8), frame[37] = uint8_t(k);
          if (k > 0 && k == hangs_up_after) {
            hangs_up_after = 0;
            frame.resize(frame.size() / 2);
            server_.send(frame);
            server_.drop();
            break;
          }
          if (!server_.send(frame) || !server_.send(table(k))) break;
          std::this_thread::sleep_for(100ms);
        }
      }
    });
  }
  std::string place() const { return "igtl://127.0.0.1:" + std::to_string(server_.port()); }

 private:
  test::WireServer server_;
  std::vector<test::Raw> frames_;
  std::jthread thread_;
};

/// Ends a program as soon as a condition is true, or after a minute: a busy machine needs longer.
/// The test checks the condition again afterwards.
template <class Condition>
Outcome ended_once(Program& program, Condition holds) {
  const auto give_up = std::chrono::steady_clock::now() + 60s;
  while (!program.ended() && std::chrono::steady_clock::now() < give_up && !holds())
    std::this_thread::sleep_for(20ms);
  program.signal(SIGINT);
  return program.wait();
}

/// The images that a client receives.
class HeardImages {
 public:
  explicit HeardImages(openigtlink::ClientOptions& options) {
    options.image = "palpate_volume";
    options.on_image = [this](openigtlink::ArrivedImage image) {
      const std::lock_guard lock(mutex_);
      images_.push_back(std::move(image));
    };
  }
  size_t count() const {
    const std::lock_guard lock(mutex_);
    return images_.size();
  }
  glm::ivec3 size() const {
    const std::lock_guard lock(mutex_);
    return images_.empty() ? glm::ivec3(0) : images_.front().volume.grid.size;
  }
  /// The largest change relative to the first image: of the mean over the samples, and of a single
  /// sample.
  struct Change {
    double mean = 0.0, single = 0.0;
  };
  Change most_changed() const {
    const std::lock_guard lock(mutex_);
    Change most;
    for (const auto& image : images_) {
      const std::vector<float>&now = image.volume.values, &first = images_.front().volume.values;
      EXPECT_EQ(now.size(), first.size());
      double sum = 0.0;
      for (size_t v = 0; v < std::min(now.size(), first.size()); ++v) {
        const double change = std::abs(now[v] - first[v]);
        sum += change;
        most.single = std::max(most.single, change);
      }
      most.mean = std::max(most.mean, sum / double(now.size()));
    }
    return most;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<openigtlink::ArrivedImage> images_;
};

/// What the newest line of a running program says of its frames: felt, and come. 0 before.
std::pair<int, int> frames_told(const Program& program) {
  static const std::regex told("([0-9]+) of ([0-9]+) frames felt");
  const std::string said = program.said();
  std::pair<int, int> newest;
  for (std::sregex_iterator at(said.begin(), said.end(), told), end; at != end; ++at)
    newest = {std::stoi((*at)[1]), std::stoi((*at)[2])};
  return newest;
}

TEST(Live, ASourceIsFeltFollowedAndItsNumbersAreSaid) {
  NEEDS_DEVICE();
  const Source source(20);
  Program program({"feel", source.place(), "--device", "simulated", "--headset", "off", "--seconds",
                   "600", "--follow"});
  const Outcome outcome = ended_once(program, [&] {
    const auto [felt, came] = frames_told(program);
    return felt > 3 && came > 30;
  });
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("is connected"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("live; the first frame stands still"), std::string::npos);
  const size_t at = outcome.out.find("images came, ");
  ASSERT_NE(at, std::string::npos) << outcome.out;
  EXPECT_GT(std::stoi(outcome.out.substr(at + 13)), 3) << outcome.out;
  EXPECT_NE(outcome.out.find("after they arrived (median"), std::string::npos);
  // The server closed the connection in the middle of a message; the client connected again.
  EXPECT_NE(outcome.out.find("connecting again"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("1 refused: torn"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("2 connections"), std::string::npos) << outcome.out;
  const size_t frames_at = outcome.out.rfind("Live ", at);
  EXPECT_GT(std::stoi(outcome.out.substr(frames_at + 5)), 30) << outcome.out;
}

TEST(Live, TransformsMoveTheVolumeAndAJumpIsNotFollowed) {
  NEEDS_DEVICE();
  const Source source;
  Program program({"feel", source.place(), "--device", "simulated", "--headset", "off", "--seconds",
                   "600", "--transform", "Table"});
  const Outcome outcome = ended_once(
      program, [&] { return program.said().find("A transform jumped") != std::string::npos; });
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("transforms, 1 of them jumped"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("A transform jumped"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("Probe: live"), std::string::npos) << outcome.out;
}

TEST(Live, APictureOfItsFirstFrameIsDrawn) {
  NEEDS_DEVICE();
  const Source source;
  const files::TemporaryFolder folder;
  const Outcome outcome = run({"view", source.place(), "--picture",
                               (folder.path() / "live.png").string(), "--picture-size", "96"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "live.png"));
}

TEST(Live, WhatIsFeltIsSentAsItMoves) {
  const uint16_t port = test::WireServer().port();
  std::atomic<int> proxies{0};
  openigtlink::ClientOptions options;
  const HeardImages images(options);
  options.transform = "palpate_proxy";
  options.on_transform = [&](const openigtlink::Rigid&) { ++proxies; };
  const auto client = openigtlink::Client::start({"127.0.0.1", port}, std::move(options));
  ASSERT_TRUE(client);
  Program program({"feel", "heart", "--device", "simulated", "--headset", "off", "--seconds", "600",
                   "--serve", std::to_string(port)});
  const Outcome outcome = ended_once(program, [&] {
    return proxies > 10 && images.count() >= 3 && images.most_changed().mean > 1.0;
  });
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_GT(proxies, 10);
  EXPECT_GE(images.count(), 3u);
  const glm::ivec3 size = images.size();
  EXPECT_LE(size.x * size.y * size.z, 64 * 64 * 64);
  EXPECT_GT(images.most_changed().mean, 1.0) << "the images of a beating heart must change";
}

TEST(Live, TheMovedVolumeIsServedWithoutAHand) {
  const uint16_t port = test::WireServer().port();
  openigtlink::ClientOptions options;
  const HeardImages images(options);
  const auto client = openigtlink::Client::start({"127.0.0.1", port}, std::move(options));
  ASSERT_TRUE(client);
  Program program({"serve", "heart", "--seconds", "600", "--port", std::to_string(port)});
  const Outcome outcome = ended_once(program, [&] { return images.most_changed().single > 50.0; });
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("the moved volume and its motion, by OpenIGTLink at port " +
                             std::to_string(port)),
            std::string::npos)
      << outcome.out;
  EXPECT_EQ(outcome.out.find("Felt"), std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.out.find(" 0 messages were sent"), std::string::npos) << outcome.out;
  EXPECT_GT(images.most_changed().single, 50.0) << "the images of a beating heart must change";
}

TEST(Live, WhatIsServedIsSaidInJson) {
  const uint16_t port = test::WireServer().port();
  Program program({"serve", "heart", "--seconds", "600", "--port", std::to_string(port), "--json"});
  // As soon as this line is there, a client may connect.
  ASSERT_TRUE(program.wait_for("\n"));
  const auto serving = nlohmann::json::parse(program.said());
  EXPECT_EQ(serving["event"], "serving");
  EXPECT_EQ(serving["port"], port);
  EXPECT_EQ(serving["frames"], 8);
  EXPECT_EQ(serving["length_s"], 2.0);
  EXPECT_EQ(serving["live"], false);
  std::atomic<int> proxies{0};
  openigtlink::ClientOptions options;
  options.transform = "palpate_proxy";
  options.on_transform = [&](const openigtlink::Rigid&) { ++proxies; };
  const auto client = openigtlink::Client::start({"127.0.0.1", port}, std::move(options));
  ASSERT_TRUE(client);
  const Outcome outcome = ended_once(program, [&] { return proxies > 3; });
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_GT(proxies, 3);
  const std::string second = outcome.out.substr(outcome.out.find('\n') + 1);
  const auto ended = nlohmann::json::parse(second);
  EXPECT_EQ(ended["event"], "ended");
  EXPECT_GE(ended["messages_sent"].get<int>(), proxies.load());
  EXPECT_EQ(ended["messages_missed"], 0);
  EXPECT_FALSE(ended.contains("live"));
  EXPECT_NE(outcome.err.find("Volume    heart"), std::string::npos) << "lines are on stderr";
}

/// The beating shell standing still, in its own patient space.
std::string still_shell(const files::TemporaryFolder& folder) {
  const std::string file = folder / "still.json";
  std::ofstream(file) << R"({"volumes": [{"name": "heart", "source": "shell", "rate": 0}],
    "modes": [{"name": "wall", "kind": "surface", "volume": "heart",
               "strength": {"window": {"level": 625, "width": 150, "full": 5}}}]})";
  return file;
}

/// Whether the volume is among the next messages of a server, which sends about twenty per second.
bool volume_comes(const openigtlink::Socket& socket, int within = 600) {
  const auto receive = [&](size_t count) {
    openigtlink::Bytes bytes(count);
    size_t at = 0;
    while (at < count) {
      if (!socket.is_ready(POLLIN, 20'000)) return openigtlink::Bytes();
      const ssize_t got = recv(socket.handle(), bytes.data() + at, count - at, 0);
      if (got <= 0) return openigtlink::Bytes();
      at += size_t(got);
    }
    return bytes;
  };
  for (int n = 0; n < within; ++n) {
    const openigtlink::Bytes head = receive(openigtlink::kHeaderBytes);
    if (head.empty()) return false;
    const auto header = openigtlink::read_header(
        std::span<const std::byte, openigtlink::kHeaderBytes>(head.data(), head.size()));
    if (!header || receive(header->body_bytes).empty()) return false;
    if (header->device == "palpate_volume") return true;
  }
  return false;
}

openigtlink::Socket connected_to(uint16_t port) {
  openigtlink::Socket socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  at.sin_port = htons(port);
  EXPECT_EQ(connect(socket.handle(), reinterpret_cast<sockaddr*>(&at), sizeof at), 0);
  return socket;
}

TEST(Live, WhoComesBackGetsTheStillVolumeAgain) {
  const files::TemporaryFolder folder;
  const uint16_t port = test::WireServer().port();
  Program program({"serve", still_shell(folder), "--port", std::to_string(port), "--json"});
  ASSERT_TRUE(program.wait_for("\n"));
  openigtlink::Socket viewer = connected_to(port);
  EXPECT_TRUE(volume_comes(viewer));
  EXPECT_FALSE(volume_comes(viewer, 60)) << "a still volume is sent once to each client";
  // Disconnected and back at once: the server never sees the number of clients change.
  viewer = openigtlink::Socket();
  viewer = connected_to(port);
  EXPECT_TRUE(volume_comes(viewer)) << "a client that reconnects needs the volume";
  // Back after the server has noticed the disconnection.
  viewer = openigtlink::Socket();
  std::this_thread::sleep_for(500ms);
  viewer = connected_to(port);
  EXPECT_TRUE(volume_comes(viewer));
  const openigtlink::Socket second = connected_to(port);
  EXPECT_TRUE(volume_comes(second)) << "a second client";
  program.signal(SIGINT);
  program.wait();
}

/// A TRANSFORM with its position in the message: RAS, mm.
test::Raw tool_at(const std::string& device, glm::dvec3 ras_mm) {
  test::Raw body;
  for (const float f : {1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, float(ras_mm.x),
                        float(ras_mm.y), float(ras_mm.z)})
    test::put_float(body, f);
  test::WireHeader header;
  header.type = "TRANSFORM";
  header.device = device;
  return test::wire_message(header, body);
}

glm::dvec3 probe_of(const Table& ticks, size_t row) {
  return {ticks.number(row, "probe_x_m"), ticks.number(row, "probe_y_m"),
          ticks.number(row, "probe_z_m")};
}

std::vector<std::string> felt_with_tool(const files::TemporaryFolder& folder, uint16_t port,
                                        double seconds) {
  return {"feel",        still_shell(folder),
          "--tool",      "igtl://127.0.0.1:" + std::to_string(port),
          "--headset",   "off",
          "--watchdog",  "1000",
          "--seconds",   std::to_string(seconds),
          "--csv",       folder / "ticks.csv",
          "--black-box", folder / "."};
}

TEST(Live, ATrackedToolIsTheHandWhereItIsInThePatient) {
  const files::TemporaryFolder folder;
  test::WireServer server;
  // To the right, in front and above, then silent, then elsewhere. Another tool must be ignored.
  std::jthread tracker([&](std::stop_token stop) {
    if (!server.accept_one(60000)) return;
    const auto send = [&](const char* name, glm::dvec3 ras_mm, int times) {
      for (int k = 0; k < times && !stop.stop_requested(); ++k) {
        server.send(tool_at(name, ras_mm));
        std::this_thread::sleep_for(20ms);
      }
    };
    // After the tool is in use: a busy machine takes long to read the scene.
    while (!std::filesystem::exists(folder / "ticks.csv") && !stop.stop_requested())
      std::this_thread::sleep_for(20ms);
    std::this_thread::sleep_for(500ms);
    send("Pen", {60.0, 30.0, 20.0}, 1);
    send("Drill", {0.0, 0.0, 0.0}, 20);
    send("Pen", {60.0, 30.0, 20.0}, 100);
    for (int k = 0; k < 20 && !stop.stop_requested(); ++k) std::this_thread::sleep_for(100ms);
    send("Pen", {-60.0, -30.0, 20.0}, 5000);
  });
  const Outcome outcome = run(felt_with_tool(folder, server.port(), 12.0));
  tracker.request_stop();
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("tracked tool, as asked"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("transform of another name"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("Tool      "), std::string::npos);
  EXPECT_EQ(outcome.out.find("the ticks around a fault"), std::string::npos) << outcome.out;
  const Table ticks(folder / "ticks.csv");
  // RAS to x = L, y = S, z = -P = A.
  const glm::dvec3 first(-0.060, 0.020, 0.030), second(0.060, 0.020, -0.030);
  size_t at_first = 0, gone = 0, at_second = 0;
  double between_m = 1.0;
  for (size_t row = 0; row < ticks.size(); ++row) {
    const glm::dvec3 probe = probe_of(ticks, row);
    const bool here = ticks.text(row, "cause") != "device";
    if (here && glm::distance(probe, first) < 1e-6) ++at_first;
    if (here && glm::distance(probe, second) < 1e-6) ++at_second;
    if (!here && at_first > 0 && at_second == 0) ++gone;
    // The probe must never be moved through the heart on its way.
    if (here && at_first > 0) between_m = std::min(between_m, glm::length(probe));
  }
  EXPECT_GT(at_first, 500u);
  EXPECT_GT(gone, 300u) << "a silent tool must count as gone";
  EXPECT_GT(at_second, 500u);
  EXPECT_GT(between_m, 0.06);
}

TEST(Live, TheirTrackerMovesTheHand) {
#ifndef TRACKER_SERVER
  GTEST_SKIP() << "openigtlink-examples or libopenigtlink-dev is missing.";
#else
  const files::TemporaryFolder folder;
  const uint16_t port = test::WireServer().port();
  const pid_t tracker = fork();
  if (tracker == 0) {
    const std::string number = std::to_string(port);
    if (!freopen("/dev/null", "w", stdout)) _exit(126);
    execl(TRACKER_SERVER, TRACKER_SERVER, number.c_str(), "50", nullptr);
    _exit(127);
  }
  const Outcome outcome = run(felt_with_tool(folder, port, 3.0));
  kill(tracker, SIGKILL);
  waitpid(tracker, nullptr, 0);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  // It moves around (50 cos phi, 50 sin phi, 50 cos phi) mm RAS, ten radians per second; the hand
  // follows a little inside.
  const Table ticks(folder / "ticks.csv");
  size_t on_the_way = 0;
  glm::dvec3 low(1.0), high(-1.0);
  for (size_t row = 0; row < ticks.size(); ++row) {
    if (ticks.text(row, "cause") == "device") continue;
    const glm::dvec3 x = probe_of(ticks, row);
    EXPECT_NEAR(x.x, -x.y, 1e-3) << row;
    low = glm::min(low, x);
    high = glm::max(high, x);
    ++on_the_way;
  }
  EXPECT_GT(on_the_way, 500u) << outcome.out;
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(low[a], -0.050, 0.006) << a;
    EXPECT_NEAR(high[a], 0.050, 0.006) << a;
  }
#endif
}

TEST(Live, WhatCanNotBeIsSaidInASentence) {
  const struct {
    std::vector<std::string> arguments;
    const char* word;
  } rows[] = {
      {{"feel", "igtl://a:b", "--device", "simulated", "--headset", "off"}, "igtl://HOST"},
      {{"feel", "igtl://127.0.0.1", "igtl://127.0.0.1", "--device", "simulated", "--headset",
        "off"},
       "alone"},
      {{"feel", "igtl://127.0.0.1", "--record", "/nonexistent/r", "--device", "simulated",
        "--headset", "off"},
       "--record"},
      {{"feel", "heart", "--tool", "nowhere", "--headset", "off"}, "igtl://HOST"},
      {{"feel", "heart", "--tool", "igtl://127.0.0.1", "--device", "simulated"}, "--device"}};
  for (const auto& row : rows) {
    const Outcome outcome = run(row.arguments);
    EXPECT_EQ(outcome.exit_code, 2) << row.word;
    EXPECT_NE(outcome.err.find(row.word), std::string::npos) << outcome.err;
  }
}

}  // namespace
}  // namespace palpate::app
