#include "integration/openigtlink/client.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <exception>
#include <new>

#include "integration/openigtlink/socket.h"

namespace palpate::openigtlink {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr int kPoll_ms = 50;  // stop() is heard as soon
constexpr auto kTorn = 3s;    // within a message so long without a byte: it is torn
constexpr auto kAgain = 500ms;
constexpr double kClockRestarted_s = 10.0;
constexpr size_t kPiece = 1 << 20;
constexpr std::string_view kScheme = "igtl://", kNoCrc = "?crc=none";

}  // namespace

struct Client::Address {
  addrinfo* first = nullptr;
  ~Address() {
    if (first) freeaddrinfo(first);
  }
};

bool is_address(const std::string& text) {
  return text.starts_with(kScheme);
}

Result<ServerAddress> read_address(const std::string& text) {
  const Error wrong{
      ErrorKind::kBadInput,
      fmt::format("'{}' is not the address of an OpenIGTLink server: give igtl://HOST "
                  "or igtl://HOST:PORT, with {} behind it if its messages have no CRC",
                  text, kNoCrc)};
  if (!is_address(text)) return wrong;
  std::string rest = text.substr(kScheme.size());
  ServerAddress server;
  if (rest.ends_with(kNoCrc)) {
    server.accepts_no_crc = true;
    rest.resize(rest.size() - kNoCrc.size());
  }
  if (rest.ends_with('/')) rest.pop_back();
  std::string port;
  if (rest.starts_with('[')) {
    const size_t end = rest.find(']');
    if (end == std::string::npos) return wrong;
    server.host = rest.substr(1, end - 1);
    port = rest.substr(end + 1);
  } else {
    const size_t colon = rest.find(':');
    server.host = rest.substr(0, colon);
    if (colon != std::string::npos) port = rest.substr(colon);
  }
  if (server.host.empty() || server.host.find_first_of("/?") != std::string::npos) return wrong;
  if (port.empty()) return server;
  int number = 0;
  const auto [end, error] = std::from_chars(port.data() + 1, port.data() + port.size(), number);
  if (port[0] != ':' || error != std::errc() || end != port.data() + port.size() || number < 1 ||
      number > 65535)
    return wrong;
  server.port = uint16_t(number);
  return server;
}

Result<std::unique_ptr<Client>> Client::start(const ServerAddress& server, ClientOptions options) {
  auto client = std::unique_ptr<Client>(new Client(std::move(options)));
  client->name_ = fmt::format("{}:{}", server.host, server.port);
  client->accepts_no_crc_ = server.accepts_no_crc;
  client->address_ = std::make_shared<Address>();
  start_sockets();
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_family = AF_UNSPEC;
  if (getaddrinfo(server.host.c_str(), std::to_string(server.port).c_str(), &wanted,
                  &client->address_->first) != 0)
    return Error{
        ErrorKind::kBadInput,
        fmt::format("There is no host '{}': check its name, or give its address", server.host)};
  client->thread_ = std::jthread([c = client.get()](std::stop_token stop) { c->run(stop); });
  return client;
}

Client::~Client() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

ClientNumbers Client::numbers() const {
  const std::lock_guard lock(mutex_);
  return numbers_;
}

/// If the listener throws, the exception is dropped: there is nothing else to report it to.
void Client::say(const std::string& sentence) {
  if (sentence == last_said_ || !options_.on_note) return;
  try {
    last_said_ = sentence;
    options_.on_note(sentence);
  } catch (...) {
  }
}

void Client::refuse(const std::string& reason, const std::string& sentence) {
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    // Reasons are texts of this program, so there are few of them.
    first = ++numbers_.refused[reason] == 1;
  }
  if (first) say(sentence);
}

void Client::run(std::stop_token stop) {
  while (!stop.stop_requested()) {
    // No exception may leave the thread: it would end the program, which may hold a force device.
    try {
      try {
        connect_once(stop);
      } catch (const std::bad_alloc&) {
        whole_.reset();
        refuse("out of memory",
               fmt::format("Memory ran out for what {} sends: close other programs, or let it send "
                           "smaller images",
                           name_));
      } catch (const std::exception& error) {
        refuse("failed", fmt::format("What {} sends could not be used: {}", name_, error.what()));
      }
      const bool was_connected = connected_.exchange(false);
      if (!stop.stop_requested() && (was_connected || !said_waiting_))
        say(was_connected ? fmt::format("The connection to {} has ended: connecting again", name_)
                          : fmt::format("There is no server at {} yet: waiting for it", name_));
      said_waiting_ = true;
    } catch (...) {
      // Of no known type, or not even a sentence found memory.
      connected_ = false;
    }
    const auto since = Clock::now();
    while (!stop.stop_requested() && Clock::now() - since < kAgain)
      std::this_thread::sleep_for(std::chrono::milliseconds(kPoll_ms));
  }
}

/// Listens to the first address that answers, until the connection ends; then, or if none answers,
/// it returns.
void Client::connect_once(std::stop_token stop) {
  for (const addrinfo* at = address_->first; at && !stop.stop_requested(); at = at->ai_next) {
    const Socket socket = Socket::make(at->ai_family, at->ai_protocol);
    if (!socket.is_open()) continue;
    SocketState state = socket.connect(at->ai_addr, at->ai_addrlen);
    const auto since = Clock::now();
    while (state == SocketState::kAgain && !stop.stop_requested() && Clock::now() - since < 5s)
      if (socket.is_ready(POLLOUT, kPoll_ms))
        state = socket.error() == 0 ? SocketState::kDone : SocketState::kFailed;
    if (state != SocketState::kDone) continue;
    socket.set(SOL_SOCKET, SO_KEEPALIVE, 1);
    {
      const std::lock_guard lock(mutex_);
      ++numbers_.connections;
    }
    // After a reconnection the source may have another clock, and parts of an image need a new
    // whole one.
    last_time_s_ = 0.0;
    last_crc_ = 0;
    whole_.reset();
    connected_ = true;
    say(fmt::format("{} is connected", name_));
    return listen(socket, stop);
  }
}

void Client::listen(const Socket& socket, std::stop_token stop) {
  // Reads `count` bytes into `to`, or skips them where it is null. False: over.
  const auto receive = [&](size_t count, Bytes* to, bool may_wait) {
    Bytes piece;
    auto last = Clock::now();
    bool begun = !may_wait;
    while (count > 0) {
      if (stop.stop_requested()) return false;
      if (!socket.is_ready(POLLIN, kPoll_ms)) {
        if (!begun || Clock::now() - last < kTorn) continue;
        refuse("torn", "A message broke off in its middle: connecting again");
        return false;
      }
      piece.resize(std::min(count, kPiece));
      size_t got = 0;
      const SocketState state = socket.receive(piece.data(), piece.size(), got);
      if (state == SocketState::kAgain) continue;
      if (state == SocketState::kFailed || got == 0) {
        if (begun) refuse("torn", "A message broke off in its middle: connecting again");
        return false;
      }
      begun = true;
      last = Clock::now();
      count -= got;
      // Memory grows with what has come, whatever the header claims.
      if (to) to->insert(to->end(), piece.begin(), piece.begin() + ptrdiff_t(got));
    }
    return true;
  };
  Bytes head, body;
  while (!stop.stop_requested()) {
    head.clear();
    body.clear();
    if (!receive(kHeaderBytes, &head, true)) return;
    const auto header =
        read_header(std::span<const std::byte, kHeaderBytes>(head.data(), kHeaderBytes));
    if (!header) return refuse("no OpenIGTLink", header.error().message);
    const bool transforms = !options_.transform.empty() || options_.first_transform;
    const bool wanted = (header->type == "IMAGE" && options_.on_image) ||
                        (header->type == "TRANSFORM" && transforms);
    if (!receive(size_t(header->body_bytes), wanted ? &body : nullptr, false)) return;
    {
      const std::lock_guard lock(mutex_);
      ++numbers_.messages;
    }
    if (wanted) take(*header, body);
    if (body.capacity() > 64 * kPiece) body = {};
  }
}

void Client::take(const Header& header, std::span<const std::byte> body) {
  if (header.crc == 0 && !accepts_no_crc_ && crc64(body) != 0)
    return refuse("no CRC",
                  fmt::format("Messages of '{}' are left out: their CRC is 0, so damage on the way "
                              "can not be seen. If their sender computes none, as PLUS does where "
                              "it is not asked to, accept them by {} behind the server's address",
                              header.device, kNoCrc));
  const auto content = content_of(header, body, accepts_no_crc_);
  if (!content) return refuse("damaged", content.error().message);
  if (header.type == "IMAGE") return take_image(header, *content);
  if (options_.transform.empty() && transform_device_.empty()) transform_device_ = header.device;
  if (header.device != (options_.transform.empty() ? transform_device_ : options_.transform))
    return refuse("transform of another name",
                  fmt::format("There are transforms of '{}', which is not the one that was asked "
                              "for",
                              header.device));
  const auto rigid = read_transform(*content);
  if (!rigid) return refuse("no rigid transform", rigid.error().message);
  {
    const std::lock_guard lock(mutex_);
    ++numbers_.transforms;
  }
  if (options_.on_transform) options_.on_transform(*rigid);
}

void Client::take_image(const Header& header, std::span<const std::byte> content) {
  arrived_ns_ = Clock::now().time_since_epoch().count();
  const std::string& wanted = options_.image.empty() ? device_ : options_.image;
  if (header.device != wanted && !(options_.image.empty() && !any_image_))
    return refuse(
        "image of another name",
        fmt::format("There are images of '{}' too; those of '{}' are felt", header.device, wanted));
  if (header.time_s > 0.0 && header.time_s < last_time_s_ &&
      last_time_s_ - header.time_s < kClockRestarted_s)
    return refuse("late", "An image was older than one that came before it, and was left out");
  if (header.crc == last_crc_ && last_crc_ != 0)
    return refuse("duplicate", "An image was the same as the one before it, and was left out");
  if (const auto size = flat_size(content))
    return refuse("flat image",
                  fmt::format("The images of '{}' are flat ({} x {} x {} samples), and only a "
                              "volume can be felt: let their sender reconstruct one, as PLUS and "
                              "3D Slicer (SlicerIGSIO) do of a tracked probe's",
                              header.device, size->x, size->y, size->z));
  auto image = read_image(content);
  if (!image) return refuse("no image of a grid", image.error().message);
  if (image->is_ras_assumed)
    say(fmt::format(
        "The images of '{}' do not say their coordinate system: they are taken for RAS, "
        "as OpenIGTLink's usually are",
        header.device));
  last_time_s_ = header.time_s;
  last_crc_ = header.crc;
  device_ = header.device;
  any_image_ = true;
  if (!image->is_whole()) return take_part(*image);
  whole_ = std::move(*image);
  give(*whole_);
}

void Client::take_part(const ImageMessage& part) {
  if (!whole_ || !same_geometry(whole_->grid, part.grid) || whole_->j_reversed != part.j_reversed)
    return refuse("part alone",
                  "A part of an image was left out: no whole image of its grid came "
                  "before it. Send the whole image first");
  const glm::ivec3 n = part.grid.size, first = part.first, size = part.size;
  for (int k = 0; k < size.z; ++k)
    for (int j = 0; j < size.y; ++j)
      std::copy_n(part.values.begin() + ptrdiff_t(size.x) * (j + ptrdiff_t(size.y) * k), size.x,
                  whole_->values.begin() + first.x +
                      ptrdiff_t(n.x) * (first.y + j + ptrdiff_t(n.y) * (first.z + k)));
  give(*whole_);
}

void Client::give(const ImageMessage& image) {
  {
    const std::lock_guard lock(mutex_);
    ++numbers_.images;
  }
  Volume volume{image.grid, image.values};
  if (image.j_reversed) {
    const glm::ivec3 n = volume.grid.size;
    for (int k = 0; k < n.z; ++k)
      for (int j = 0; j < n.y / 2; ++j)
        std::swap_ranges(volume.values.begin() + ptrdiff_t(volume.grid.offset(0, j, k)),
                         volume.values.begin() + ptrdiff_t(volume.grid.offset(0, j, k)) + n.x,
                         volume.values.begin() + ptrdiff_t(volume.grid.offset(0, n.y - 1 - j, k)));
  }
  if (options_.on_image) options_.on_image({device_, std::move(volume), arrived_ns_, last_time_s_});
}

}  // namespace palpate::openigtlink
