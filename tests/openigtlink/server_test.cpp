// The server when memory runs out on its thread.
#include "integration/openigtlink/server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <new>
#include <thread>

#include "integration/openigtlink/client.h"

namespace {

/// While it is set, only threads that are exempt get memory from `new`.
std::atomic<bool> others_get_none{false};
thread_local bool is_exempt = false;

}  // namespace

// As the standard's own, unless a test simulates a lack of memory.
[[gnu::noinline]] void* operator new(size_t size) {
  void* const memory = others_get_none && !is_exempt ? nullptr : std::malloc(size > 0 ? size : 1);
  if (!memory) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, size_t) noexcept {
  std::free(memory);
}

namespace palpate::openigtlink {
namespace {

using namespace std::chrono_literals;

TEST(Server, HangsUpWhereMemoryRunsOutAndServesWhoComesBack) {
  is_exempt = true;
  auto server = Server::start(0);
  ASSERT_TRUE(server) << server.error().message;
  const auto connected = [&](const Socket& socket, uint16_t port) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    at.sin_port = htons(port);
    return connect(socket.handle(), reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  };
  const auto come_to = [&](size_t clients) {
    for (int k = 0; k < 1000 && (*server)->clients() != clients; ++k)
      std::this_thread::sleep_for(5ms);
    return (*server)->clients() == clients;
  };
  const Socket first(socket(AF_INET, SOCK_STREAM, 0));
  ASSERT_TRUE(connected(first, (*server)->port()));
  ASSERT_TRUE(come_to(1));
  const auto message = std::make_shared<const Bytes>(write_status("palpate", 1.0, 1, "felt"));
  others_get_none = true;
  (*server)->send(message);
  const bool hung_up = come_to(0);
  others_get_none = false;
  ASSERT_TRUE(hung_up) << "without this recv() would wait for ever";
  std::byte byte{};
  EXPECT_EQ(recv(first.handle(), &byte, 1, 0), 0) << "the connection ended";

  const Socket again(socket(AF_INET, SOCK_STREAM, 0));
  ASSERT_TRUE(connected(again, (*server)->port()));
  ASSERT_TRUE(come_to(1));
  (*server)->send(message);
  Bytes got(message->size());
  EXPECT_EQ(recv(again.handle(), got.data(), got.size(), MSG_WAITALL), ssize_t(got.size()));
  EXPECT_EQ(got, *message);
  is_exempt = false;
}

}  // namespace
}  // namespace palpate::openigtlink
