#include "tests/devices/emulated_haply.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <boost/uuid/detail/sha1.hpp>
#include <chrono>
#include <cstring>
#include <stdexcept>

namespace palpate::devices::test {
namespace {

using Json = nlohmann::json;

// The middle of the workspace relative to the mounting plate, in the service's own axes.
constexpr glm::dvec3 kMiddle{0.0, -0.12, 0.15};
constexpr const char* kRfcGuid = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";

int listen_on(uint16_t& port) {
  const int file = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  setsockopt(file, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  place.sin_port = htons(port);
  if (bind(file, reinterpret_cast<sockaddr*>(&place), sizeof place) != 0 || listen(file, 8) != 0)
    throw std::runtime_error("no port to listen on");
  socklen_t size = sizeof place;
  getsockname(file, reinterpret_cast<sockaddr*>(&place), &size);
  port = ntohs(place.sin_port);
  return file;
}

std::string base64(const std::array<uint8_t, 20>& bytes) {
  const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t n = 0; n < bytes.size(); n += 3) {
    const auto at = [&](size_t k) { return k < bytes.size() ? uint32_t(bytes[k]) : 0u; };
    const uint32_t three = at(n) << 16 | at(n + 1) << 8 | at(n + 2);
    for (int k = 3; k >= 0; --k) text += letters[three >> (6 * k) & 63];
  }
  // 20 bytes leave one character of padding.
  text.back() = '=';
  return text;
}

/// RFC 6455, 4.2.2: the answer to a client's key.
std::string accept_of(const std::string& key) {
  boost::uuids::detail::sha1 hash;
  const std::string text = key + kRfcGuid;
  hash.process_bytes(text.data(), text.size());
  // Five words, or twenty bytes since Boost 1.86.
  boost::uuids::detail::sha1::digest_type digest;
  hash.get_digest(digest);
  constexpr size_t kWidth = sizeof digest[0];
  std::array<uint8_t, 20> bytes;
  for (size_t n = 0; n < 20; ++n)
    bytes[n] = uint8_t(digest[n / kWidth] >> (8 * (kWidth - 1 - n % kWidth)));
  return base64(bytes);
}

/// A frame of the server: not masked.
std::string frame(int opcode, const std::string& text, bool last = true) {
  std::string bytes(1, char((last ? 0x80 : 0) | opcode));
  if (text.size() < 126) {
    bytes += char(text.size());
  } else if (text.size() < 65536) {
    bytes += char(126);
    bytes += char(text.size() >> 8);
    bytes += char(text.size() & 0xff);
  } else {
    bytes += char(127);
    for (int k = 7; k >= 0; --k) bytes += char(uint64_t(text.size()) >> (8 * k) & 0xff);
  }
  return bytes + text;
}

std::string header(const std::string& request, const std::string& name) {
  std::string lower = request;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](char c) { return char(std::tolower(c)); });
  const size_t at = lower.find("\r\n" + name + ":");
  if (at == std::string::npos) return "";
  const size_t from = request.find_first_not_of(' ', at + name.size() + 3);
  return request.substr(from, request.find("\r\n", from) - from);
}

Json vector_json(glm::dvec3 v) {
  return {{"x", v.x}, {"y", v.y}, {"z", v.z}};
}

}  // namespace

EmulatedHaply::EmulatedHaply(Options options)
    : options_(std::move(options)), port_(options_.port), events_port_(options_.events_port) {
  start_service();
}

EmulatedHaply::~EmulatedHaply() {
  if (thread_.joinable()) stop_service();
}

void EmulatedHaply::start_service() {
  listen_ = listen_on(port_);
  listen_events_ = listen_on(events_port_);
  stop_ = false;
  thread_ = std::thread([this] { serve(); });
}

void EmulatedHaply::stop_service() {
  stop_ = true;
  thread_.join();
  for (Connection& connection : connections_) close(connection.file);
  connections_.clear();
  close(listen_);
  close(listen_events_);
}

void EmulatedHaply::place(glm::dvec3 position_m) {
  const Lock lock(mutex_);
  place_m_ = position_m;
}

size_t EmulatedHaply::received_count() const {
  const Lock lock(mutex_);
  return received_.size();
}

bool EmulatedHaply::pushed(size_t command) const {
  const Lock lock(mutex_);
  return received_.at(command) != glm::dvec3(0.0);
}

glm::dvec3 EmulatedHaply::force_n() const {
  const Lock lock(mutex_);
  return received_.empty() ? glm::dvec3(0.0) : received_.back();
}

std::vector<std::string> EmulatedHaply::broken_rules() const {
  const Lock lock(mutex_);
  return broken_;
}

std::string EmulatedHaply::profile() const {
  const Lock lock(mutex_);
  return profile_;
}

size_t EmulatedHaply::sessions() const {
  const Lock lock(mutex_);
  return sessions_;
}

void EmulatedHaply::press(bool down) {
  const Lock lock(mutex_);
  pressed_ = down;
}

void EmulatedHaply::change(const std::function<void(Options&)>& change) {
  const Lock lock(mutex_);
  change(options_);
}

void EmulatedHaply::set(Faults faults) {
  change_faults([&](Faults& now) { now = std::move(faults); });
}

void EmulatedHaply::change_faults(const std::function<void(Faults&)>& change) {
  const Lock lock(mutex_);
  change(faults_);
}

void EmulatedHaply::tell(const Json& event) {
  const Lock lock(mutex_);
  for (Connection& connection : connections_)
    if (connection.events && connection.upgraded) write(connection, frame(1, event.dump()));
}

void EmulatedHaply::drop_listeners() {
  const Lock lock(mutex_);
  // serve() detects that they ended, and removes them.
  for (const Connection& connection : connections_)
    if (connection.events) shutdown(connection.file, SHUT_RDWR);
}

size_t EmulatedHaply::listeners() const {
  const Lock lock(mutex_);
  return listeners_;
}

void EmulatedHaply::break_rule(const std::string& what) {
  broken_.push_back(what);
}

void EmulatedHaply::serve() {
  while (!stop_) {
    std::vector<pollfd> files{{listen_, POLLIN, 0}, {listen_events_, POLLIN, 0}};
    {
      const Lock lock(mutex_);
      for (const Connection& connection : connections_)
        files.push_back({connection.file, POLLIN, 0});
    }
    if (poll(files.data(), files.size(), 5) <= 0) continue;
    const Lock lock(mutex_);
    size_t n = 2;
    for (auto c = connections_.begin(); c != connections_.end() && n < files.size(); ++n) {
      const bool lives = !files[n].revents || hear(*c);
      if (!lives) {
        close(c->file);
        // The forces of a session end with it.
        if (c->upgraded && !c->events) received_.emplace_back(0.0);
      }
      c = lives ? std::next(c) : connections_.erase(c);
    }
    for (const size_t l : {size_t(0), size_t(1)}) {
      if (!files[l].revents || !faults_.accepts) continue;
      const int file = accept4(files[l].fd, nullptr, nullptr, SOCK_CLOEXEC);
      const int yes = 1;
      setsockopt(file, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
      connections_.push_back({file, l == 1, false, false, {}});
    }
  }
}

/// Reads from a connection; false: it is over.
bool EmulatedHaply::hear(Connection& connection) {
  char bytes[4096];
  const ssize_t got = recv(connection.file, bytes, sizeof bytes, MSG_DONTWAIT);
  if (got <= 0) return got < 0 && (errno == EAGAIN || errno == EINTR);
  connection.in.append(bytes, size_t(got));
  if (!connection.upgraded) return upgrade(connection);
  for (bool any = true; any;)
    if (!take_frame(connection, any)) return false;
  return true;
}

/// Handles the request's head: begins a WebSocket, or answers GET /version.
bool EmulatedHaply::upgrade(Connection& connection) {
  const size_t end = connection.in.find("\r\n\r\n");
  if (end == std::string::npos) return true;
  const std::string request = connection.in.substr(0, end + 2);
  connection.in.erase(0, end + 4);
  if (request.starts_with("GET /version ")) {
    const std::string body = Json{
        {"project_name", "emulated"},
        {"git_tag", options_.version},
        {"git_hash", "9.9"}}.dump();
    write(connection,
          options_.knows_version
              ? "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: " +
                    std::to_string(body.size()) + "\r\n\r\n" + body
              : "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n");
    return false;
  }
  const std::string key = header(request, "sec-websocket-key");
  if (key.empty() || header(request, "sec-websocket-version") != "13") {
    break_rule("not a WebSocket's request");
    return false;
  }
  write(connection,
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Accept: " +
            accept_of(key) + "\r\n\r\n");
  connection.upgraded = true;
  if (connection.events) {
    ++listeners_;
    return true;
  }
  ++sessions_;
  say(connection, state(connection, true).dump());
  return true;
}

/// Handles one frame of the client, which must be masked; false: it closes, or breaks a rule.
bool EmulatedHaply::take_frame(Connection& connection, bool& any) {
  any = false;
  const std::string& in = connection.in;
  if (in.size() < 2) return true;
  const int opcode = in[0] & 0x0f;
  size_t length = size_t(in[1] & 0x7f), at = 2;
  if (!(in[1] & 0x80)) {
    break_rule("a frame that is not masked");
    return false;
  }
  if (length == 126) {
    if (in.size() < 4) return true;
    length = size_t(uint8_t(in[2])) << 8 | uint8_t(in[3]);
    at = 4;
  } else if (length == 127) {
    break_rule("a message larger than any command");
    return false;
  }
  if (in.size() < at + 4 + length) return true;
  const std::string mask = in.substr(at, 4);
  std::string text = in.substr(at + 4, length);
  for (size_t n = 0; n < length; ++n) text[n] = char(text[n] ^ mask[n % 4]);
  connection.in.erase(0, at + 4 + length);
  any = true;
  if (opcode == 8) {
    write(connection, frame(8, text));
    return false;
  }
  if (opcode == 10) return true;
  if (opcode != 1 || connection.events) {
    break_rule("a frame that is no text message");
    return false;
  }
  obey(connection, text);
  return true;
}

void EmulatedHaply::obey(Connection& connection, const std::string& text) {
  const Json message = Json::parse(text, nullptr, false);
  if (!message.is_object()) {
    break_rule("no JSON: " + text);
    return;
  }
  if (message.contains("session"))
    profile_ = message["session"]["configure"]["profile"].value("name", "");
  const bool old = options_.version < "3.2";
  for (const Json& device : message.value("inverse3", Json::array())) {
    if (device.value("device_id", "") != options_.id) {
      break_rule("a command for another device");
      continue;
    }
    if (device.contains("configure")) {
      if (options_.version < "3.5") break_rule("a configuration that this version does not have");
      connection.configured =
          device["configure"].contains("preset") &&
          device["configure"]["preset"].value("preset", "") == "arm_front_centered";
    }
    if (!device.contains("commands")) continue;
    const Json force = device["commands"]["set_cursor_force"];
    const char* word = old ? "values" : "vector";
    if (!force.is_object() || !force.contains(word)) {
      break_rule(std::string("a force without ") + word);
      continue;
    }
    const Json& f = force[word];
    // The service: y away from the user, z up.
    received_.emplace_back(f.at("x").get<double>(), f.at("z").get<double>(),
                           -f.at("y").get<double>());
  }
  if (faults_.silent) return;
  std::string answer = state(connection, false).dump();
  if (faults_.mangle) answer = faults_.mangle(std::move(answer));
  for (int n = 0; n < faults_.copies; ++n) say(connection, answer);
}

Json EmulatedHaply::state(const Connection& connection, bool all) const {
  Json json = {{"inverse3", Json::array()}, {"verse_grip", Json::array()}};
  if (all) json["session_id"] = 7;
  glm::dvec3 place{place_m_.x, -place_m_.z, place_m_.y};
  if (!connection.configured) place += kMiddle;
  if (options_.connected) {
    Json device = {{"device_id", options_.id},
                   {"state",
                    {{"cursor_position", vector_json(place)},
                     {"cursor_velocity", vector_json(glm::dvec3(0.0))},
                     {"control_domain", "cartesian"}}},
                   {"status",
                    {{"calibrated", options_.calibrated},
                     {"in_use", all ? options_.in_use : true},
                     {"power_supply", options_.powered},
                     {"ready", options_.ready},
                     {"started", true}}}};
    if (all) device["config"] = {{"type", options_.type}, {"basis", {{"permutation", "XYZ"}}}};
    json["inverse3"].push_back(device);
  }
  json["verse_grip"].push_back({{"device_id", "61548"}, {"state", {{"button", pressed_}}}});
  return json;
}

void EmulatedHaply::say(Connection& connection, const std::string& text) {
  if (!faults_.raw.empty()) {
    write(connection, faults_.raw);
    return;
  }
  if (faults_.delay_ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(faults_.delay_ns));
  if (faults_.pings) write(connection, frame(9, "still there?"));
  if (faults_.fragment == 0) {
    write(connection, frame(1, text));
    return;
  }
  for (size_t at = 0; at < text.size(); at += faults_.fragment)
    write(connection, frame(at == 0 ? 1 : 0, text.substr(at, faults_.fragment),
                            at + faults_.fragment >= text.size()));
}

void EmulatedHaply::write(Connection& connection, const std::string& bytes) {
  const size_t piece = faults_.torn > 0 ? faults_.torn : bytes.size();
  for (size_t at = 0; at < bytes.size(); at += piece) {
    const size_t count = std::min(piece, bytes.size() - at);
    if (send(connection.file, bytes.data() + at, count, MSG_NOSIGNAL) < 0) return;
    if (piece < bytes.size()) std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
}

}  // namespace palpate::devices::test
