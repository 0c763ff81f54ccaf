#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

/// OpenIGTLink's messages by the protocol's documents, written independently of palpate's code.
namespace palpate::test {

using Raw = std::vector<uint8_t>;

inline void put(Raw& to, uint64_t value, int bytes) {
  for (int b = bytes - 1; b >= 0; --b) to.push_back(uint8_t(value >> (8 * b)));
}
inline void put_float(Raw& to, float value) {
  put(to, std::bit_cast<uint32_t>(value), 4);
}
inline void put_text(Raw& to, const std::string& text, size_t size) {
  for (size_t b = 0; b < size; ++b) to.push_back(b < text.size() ? uint8_t(text[b]) : 0);
}

/// Bit by bit, by the definition of the polynomial.
inline uint64_t wire_crc(const Raw& bytes) {
  uint64_t sum = 0;
  for (const uint8_t byte : bytes)
    for (int bit = 7; bit >= 0; --bit) {
      const bool out = (sum >> 63) != ((byte >> bit) & 1);
      sum = (sum << 1) ^ (out ? 0x42F0E1EBA9EA3693ULL : 0);
    }
  return sum;
}

/// The fields of a header, valid or not.
struct WireHeader {
  int version = 1;
  std::string type = "IMAGE", device = "Probe";
  uint32_t seconds = 100;
  /// Below 0: the true number.
  int64_t body_bytes = -1;
  uint64_t crc_error = 0;
};

inline Raw wire_message(const WireHeader& header, const Raw& body) {
  Raw out;
  put(out, uint64_t(header.version), 2);
  put_text(out, header.type, 12);
  put_text(out, header.device, 20);
  put(out, header.seconds, 4);
  // Half a second.
  put(out, 0x80000000u, 4);
  put(out, header.body_bytes < 0 ? body.size() : uint64_t(header.body_bytes), 8);
  put(out, wire_crc(body) ^ header.crc_error, 8);
  out.insert(out.end(), body.begin(), body.end());
  return out;
}

/// An IMAGE's body: the matrix columns are i, j, k in mm, then the middle of the image.
struct WireImage {
  int components = 1, scalar_type = 3, endian = 2, coordinates = 1;
  std::vector<int> size{4, 3, 2}, first{0, 0, 0}, part{4, 3, 2};
  std::vector<float> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  Raw samples;  ///< empty: 0, 1, 2, ... as bytes

  Raw body() const {
    Raw out;
    put(out, 1, 2);
    for (const int byte : {components, scalar_type, endian, coordinates})
      out.push_back(uint8_t(byte));
    for (const int n : size) put(out, uint64_t(n), 2);
    for (const float f : matrix) put_float(out, f);
    for (const int n : first) put(out, uint64_t(n), 2);
    for (const int n : part) put(out, uint64_t(n), 2);
    if (samples.empty())
      for (int n = 0; n < part[0] * part[1] * part[2]; ++n) out.push_back(uint8_t(n));
    out.insert(out.end(), samples.begin(), samples.end());
    return out;
  }
};

/// The body of version 2 and 3: an extended header before the content, metadata after it.
inline Raw extended(const Raw& content, const Raw& meta_header, const Raw& meta) {
  Raw out;
  put(out, 12, 2);
  put(out, meta_header.size(), 2);
  put(out, meta.size(), 4);
  put(out, 7, 4);
  for (const Raw* part : {&content, &meta_header, &meta})
    out.insert(out.end(), part->begin(), part->end());
  return out;
}

/// Listens on a port of this machine and sends the test's messages.
class WireServer {
 public:
  WireServer() { listen_at(0); }
  ~WireServer() {
    drop();
    close(listener_);
  }
  WireServer(const WireServer&) = delete;
  WireServer& operator=(const WireServer&) = delete;

  uint16_t port() const { return port_; }
  /// Waits for the next client. False: there was none in time.
  bool accept_one(int wait_ms = 30'000) {
    drop();
    pollfd polled{listener_, POLLIN, 0};
    if (poll(&polled, 1, wait_ms) <= 0) return false;
    connection_ = accept(listener_, nullptr, nullptr);
    return connection_ >= 0;
  }
  bool send(const Raw& bytes) {
    size_t sent = 0;
    while (sent < bytes.size()) {
      const ssize_t n = ::send(connection_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (n <= 0) return false;
      sent += size_t(n);
    }
    return true;
  }
  void drop() {
    if (connection_ >= 0) close(connection_);
    connection_ = -1;
  }
  void go_away() {
    drop();
    close(listener_);
    listener_ = -1;
  }
  void come_back() { listen_at(port_); }

 private:
  void listen_at(uint16_t port) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int on = 1;
    setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    at.sin_port = htons(port);
    socklen_t size = sizeof at;
    if (bind(listener_, reinterpret_cast<sockaddr*>(&at), size) != 0 || listen(listener_, 4) != 0)
      return;
    getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size);
    port_ = ntohs(at.sin_port);
  }
  int listener_ = -1, connection_ = -1;
  uint16_t port_ = 0;
};

}  // namespace palpate::test
