// Programs of others at the other end: Debian's openigtlink-examples, built from their sources, and
// a source of images made with the OpenIGTLink library.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <mutex>
#include <sstream>
#include <thread>

#include "integration/openigtlink/client.h"
#include "integration/openigtlink/server.h"
#include "tests/openigtlink/wire.h"
#include "tests/support/wait_for.h"

namespace palpate::openigtlink {
namespace {

/// Another program; ended with this object.
class Other {
 public:
  Other(const std::vector<std::string>& arguments, const std::string& output) {
    pid_ = fork();
    if (pid_ != 0) return;
    if (!freopen(output.c_str(), "w", stdout) || dup2(1, 2) < 0) _exit(126);
    std::vector<char*> argv;
    for (const std::string& argument : arguments)
      argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    execv(argv[0], argv.data());
    _exit(127);
  }
  ~Other() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }

 private:
  pid_t pid_;
};

[[maybe_unused]] uint16_t free_port() {
  return test::WireServer().port();
}

[[maybe_unused]] std::string text_of(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

TEST(Counterparts, TheirTrackerIsHeard) {
#ifndef TRACKER_SERVER
  GTEST_SKIP() << "openigtlink-examples or libopenigtlink-dev is missing.";
#else
  const uint16_t port = free_port();
  const Other tracker({TRACKER_SERVER, std::to_string(port), "50"}, "/dev/null");
  std::atomic<int> heard{0};
  std::mutex mutex;
  Rigid last;
  ClientOptions options;
  options.transform = "Tracker";
  options.on_transform = [&](const Rigid& rigid) {
    const std::lock_guard lock(mutex);
    last = rigid;
    ++heard;
  };
  auto client = Client::start({"127.0.0.1", port}, std::move(options));
  ASSERT_TRUE(client);
  EXPECT_TRUE(wait_for([&] { return heard >= 10; }));
  EXPECT_TRUE((*client)->numbers().refused.empty());
  const std::lock_guard lock(mutex);
  EXPECT_NEAR(glm::determinant(last.rotation), 1.0, 1e-9);
#endif
}

TEST(Counterparts, TheirImagesLieWhereTheyWereMade) {
#ifndef IGTL_SOURCE
  GTEST_SKIP() << "libopenigtlink-dev is missing.";
#else
  const uint16_t port = free_port();
  const Other source({IGTL_SOURCE, std::to_string(port), "20", "2", "cycle"}, "/dev/null");
  std::mutex mutex;
  std::vector<ArrivedImage> images;
  ClientOptions options;
  options.on_image = [&](ArrivedImage image) {
    const std::lock_guard lock(mutex);
    images.push_back(std::move(image));
  };
  auto client = Client::start({"127.0.0.1", port}, std::move(options));
  ASSERT_TRUE(client);
  ASSERT_TRUE(wait_for([&] {
    const std::lock_guard lock(mutex);
    return images.size() >= 5;
  }));
  const std::lock_guard lock(mutex);
  const Grid& grid = images[0].volume.grid;
  EXPECT_EQ(grid.size, glm::ivec3(64));
  EXPECT_LT(glm::length(grid.origin_mm - glm::dvec3(-0.75 * 63)), 1e-4);
  EXPECT_EQ(images[0].device, "Source");
  EXPECT_GT(images[1].time_s, images[0].time_s);
  EXPECT_NEAR(images[0].volume.at(32, 32, 32), 1000.0, 60.0);  // noise of 10
  EXPECT_NEAR(images[0].volume.at(2, 2, 2), 0.0, 60.0);
#endif
}

TEST(Counterparts, TheirReceiverUnderstandsWhatIsSent) {
#ifndef RECEIVE_CLIENT
  GTEST_SKIP() << "openigtlink-examples or libopenigtlink-dev is missing.";
#else
  auto server = Server::start(0);
  ASSERT_TRUE(server);
  const std::string output = testing::TempDir() + "igtl_received_" + std::to_string(getpid());
  const Other receiver({RECEIVE_CLIENT, "127.0.0.1", std::to_string((*server)->port())}, output);
  ASSERT_TRUE(wait_for([&] { return (*server)->clients() == 1; }));
  Grid grid;
  grid.size = {5, 4, 3};
  grid.spacing_mm = {1.0, 2.0, 3.0};
  const std::vector<float> values(60, 1.0f);
  const std::vector<glm::vec3> vectors(60, glm::vec3(2.0f));
  Rigid rigid;
  rigid.translation_mm = {-11, -22, 33};
  for (Bytes message :
       {write_transform("palpate_proxy", 1.0, rigid), write_force("palpate_force", 1.0, {1, 2, 3}),
        write_image("palpate_volume", 1.0, grid, values),
        write_image("palpate_motion", 1.0, grid, vectors),
        write_status("palpate", 1.0, 1, "felt as it should be")})
    (*server)->send(std::make_shared<const Bytes>(std::move(message)));
  // It prints a message when the next one begins, and buffers its output, so more messages are
  // sent.
  std::string text;
  EXPECT_TRUE(wait_for([&] {
    for (int n = 0; n < 5; ++n)
      (*server)->send(
          std::make_shared<const Bytes>(write_status("palpate", 1.0, 1, "felt as it should be")));
    text = text_of(output);
    return text.find("felt as it should be") != std::string::npos;
  }));
  for (const char* word : {"0, 0, 1, 33", "1, 0, 0, 11", "0, 1, 0, 22", "SENSOR", "palpate_volume",
                           "palpate_motion", "(5, 4, 3)", "(1, 2, 3)"})
    EXPECT_NE(text.find(word), std::string::npos) << word << " is missing in\n" << text;
  std::remove(output.c_str());
#endif
}

TEST(Serving, ASlowClientMissesMessagesAndNobodyWaits) {
  auto server = Server::start(0);
  ASSERT_TRUE(server);
  // Connects and reads nothing.
  const Socket slow(socket(AF_INET, SOCK_STREAM, 0));
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  at.sin_port = htons((*server)->port());
  ASSERT_EQ(connect(slow.handle(), reinterpret_cast<sockaddr*>(&at), sizeof at), 0);
  ASSERT_TRUE(wait_for([&] { return (*server)->clients() == 1; }));
  Grid grid;
  grid.size = {100, 100, 100};
  const auto image = std::make_shared<const Bytes>(
      write_image("palpate_volume", 1.0, grid, std::vector<float>(1'000'000)));
  EXPECT_TRUE(wait_for([&] {
    (*server)->send(image);
    return (*server)->missed() > 3;
  }));
  EXPECT_LT((*server)->sent(), 8u);
  // A port in use is reported.
  const auto second = Server::start((*server)->port());
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("choose another"), std::string::npos);
}

/// Whether this machine has an IPv6 address, if only its own.
bool has_six() {
  const Socket probe(socket(AF_INET6, SOCK_STREAM, 0));
  sockaddr_in6 at{};
  at.sin6_family = AF_INET6;
  at.sin6_addr = in6addr_loopback;
  return bind(probe.handle(), reinterpret_cast<sockaddr*>(&at), sizeof at) == 0;
}

TEST(Serving, IsFoundByBothKindsOfAddresses) {
  if (!has_six()) GTEST_SKIP() << "This machine has no IPv6.";
  auto server = Server::start(0);
  ASSERT_TRUE(server);
  for (const char* host : {"127.0.0.1", "::1"}) {
    std::atomic<int> heard{0};
    ClientOptions options;
    options.transform = "palpate_proxy";
    options.on_transform = [&](const Rigid&) { ++heard; };
    const auto client = Client::start({host, (*server)->port()}, std::move(options));
    ASSERT_TRUE(client) << host;
    EXPECT_TRUE(wait_for([&] {
      (*server)->send(std::make_shared<const Bytes>(write_transform("palpate_proxy", 1.0, {})));
      return heard > 0;
    })) << host;
  }
  EXPECT_EQ((*server)->connections(), 2u);
}

/// A port that is in use for one kind of addresses only is refused: half of the clients would reach
/// another program.
TEST(Serving, APortThatIsHalfTakenIsRefused) {
  if (!has_six()) GTEST_SKIP() << "This machine has no IPv6.";
  const Socket other(socket(AF_INET6, SOCK_STREAM, 0));
  const int on = 1;
  setsockopt(other.handle(), IPPROTO_IPV6, IPV6_V6ONLY, &on, sizeof on);
  sockaddr_in6 at{};
  at.sin6_family = AF_INET6;
  at.sin6_addr = in6addr_loopback;
  socklen_t size = sizeof at;
  ASSERT_EQ(bind(other.handle(), reinterpret_cast<sockaddr*>(&at), size), 0);
  ASSERT_EQ(listen(other.handle(), 1), 0);
  getsockname(other.handle(), reinterpret_cast<sockaddr*>(&at), &size);
  EXPECT_FALSE(Server::start(ntohs(at.sin6_port)));
}

}  // namespace
}  // namespace palpate::openigtlink
