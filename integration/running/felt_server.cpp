#include "integration/running/felt_server.h"

#include <chrono>
#include <cmath>

#include "compute/vulkan/caught.h"
#include "module/haptics/servo/real_time.h"
#include "module/session/moved_volume.h"

namespace palpate::running {
namespace {

using namespace std::chrono_literals;

constexpr auto kPlaces = 100ms, kImages = 500ms;
constexpr size_t kMostSamples = 64 * 64 * 64;

double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

openigtlink::Rigid at(glm::dvec3 lps_mm) {
  openigtlink::Rigid rigid;
  rigid.translation_mm = lps_mm;
  return rigid;
}

}  // namespace

Result<std::unique_ptr<FeltServer>> FeltServer::start(uint16_t port) {
  auto server = openigtlink::Server::start(port);
  if (!server) return server.error();
  auto felt = std::unique_ptr<FeltServer>(new FeltServer);
  felt->server_ = std::move(*server);
  return felt;
}

void FeltServer::begin(Session& session) {
  // If memory runs out a message is left out; the next one may succeed.
  places_ = std::make_unique<Background>(kPlaces, [this, &session] {
    (void)caught([&]() -> Status {
      send_places(session);
      return Nothing{};
    });
  });
  images_ = std::jthread([this, &session](std::stop_token stop) {
    give_way(BackgroundWork::kEstimation);
    while (!stop.stop_requested())
      (void)caught([&]() -> Status {
        send_images(stop, session);
        return Nothing{};
      });
  });
}

void FeltServer::end() {
  images_.request_stop();
  if (images_.joinable()) images_.join();
  places_.reset();
}

void FeltServer::send_places(Session& session) {
  SceneSnapshot snapshot;
  if (!session.newest(SnapshotReader::kServer, snapshot)) return;
  {
    const std::lock_guard lock(mutex_);
    snapshot_ = snapshot;
  }
  if (server_->clients() == 0 || snapshot.volume_count == 0) return;
  const Transform& place = snapshot.volumes[0].world_from_volume;
  const glm::dvec3 proxy_mm = lps_from_volume(place.volume_from_world(snapshot.proxy_m));
  const glm::dvec3 force_n =
      1e-3 * lps_from_volume(glm::conjugate(place.rotation) * snapshot.force_n);
  const auto send = [&](openigtlink::Bytes bytes) {
    server_->send(std::make_shared<const openigtlink::Bytes>(std::move(bytes)));
  };
  send(openigtlink::write_transform("palpate_proxy", now_s(), at(proxy_mm)));
  send(openigtlink::write_force("palpate_force", now_s(), force_n));
  if (++ticks_ % 10 == 1)
    send(openigtlink::write_status(
        "palpate", now_s(), snapshot.cause == Cause::kNone ? 1 : 13,
        snapshot.cause == Cause::kNone ? "felt" : sentence(snapshot.cause)));
}

void FeltServer::send_images(std::stop_token stop, Session& session) {
  std::shared_ptr<const MovingVolume> last;
  double last_s = -1.0;
  uint64_t last_connections = 0;
  while (!stop.stop_requested()) {
    std::this_thread::sleep_for(100ms);
    SceneSnapshot snapshot;
    {
      const std::lock_guard lock(mutex_);
      snapshot = snapshot_;
    }
    // The count of connections so far, not of present ones: one may leave while another one comes.
    const uint64_t connections = server_->connections();
    if (server_->clients() == 0 || snapshot.volume_count == 0) continue;
    const auto volume = session.scene()->volumes[0].data;
    const double time_s = snapshot.volumes[0].time_s;
    // The same volume is sent again only to new clients.
    if (volume == last && std::abs(time_s - last_s) < 1e-3 && connections == last_connections)
      continue;
    last = volume;
    last_s = time_s;
    last_connections = connections;
    const MovedVolume moved = moved_volume(*volume, time_s, kMostSamples, stop);
    if (moved.values.values.size() != moved.values.grid.count() || moved.values.values.empty())
      continue;
    const Grid& grid = moved.values.grid;
    server_->send(std::make_shared<const openigtlink::Bytes>(
        openigtlink::write_image("palpate_volume", now_s(), grid, moved.values.values)));
    server_->send(std::make_shared<const openigtlink::Bytes>(
        openigtlink::write_image("palpate_motion", now_s(), grid, moved.moved_mm)));
    for (int n = 0; n < 4 && !stop.stop_requested(); ++n)
      std::this_thread::sleep_for((kImages - 100ms) / 4);
  }
}

}  // namespace palpate::running
