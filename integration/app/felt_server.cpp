#include "integration/app/felt_server.h"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cmath>

#include "module/scene/playback.h"

namespace palpate::app {
namespace {

using namespace std::chrono_literals;

constexpr auto kPlaces = 100ms, kImages = 500ms;
constexpr size_t kMostSamples = 64 * 64 * 64;
constexpr int kSteps = 8;  // of the fixed point that inverts the motion
constexpr double kInverted_m = 1e-5;

/// Volume space (x = L, y = S, z = -P) to LPS.
glm::dvec3 lps(glm::dvec3 volume) {
  return {volume.x, -volume.z, volume.y};
}

double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

Grid grid_of(const GridPlace& place, size_t most_samples) {
  const glm::dmat3 volume_from_index = glm::inverse(place.index_from_volume);
  int stride = 1;
  const auto size = [&] { return (place.size + stride - 1) / stride; };
  while (size_t(size().x) * size_t(size().y) * size_t(size().z) > most_samples) ++stride;
  Grid grid;
  grid.size = size();
  grid.origin_mm = 1e3 * lps(volume_from_index * -place.offset);
  for (int a = 0; a < 3; ++a) {
    const glm::dvec3 axis = 1e3 * double(stride) * lps(volume_from_index[a]);
    grid.spacing_mm[a] = glm::length(axis);
    grid.direction[a] = axis / grid.spacing_mm[a];
  }
  return grid;
}

openigtlink::Rigid at(glm::dvec3 lps_mm) {
  openigtlink::Rigid rigid;
  rigid.translation_mm = lps_mm;
  return rigid;
}

}  // namespace

MovedVolume moved_volume(const MovingVolume& volume, double time_s, size_t most_samples,
                         std::stop_token stop) {
  MovedVolume moved;
  const ScalarSamples samples = volume.frames.front()->samples();
  if (!samples.place) return moved;
  const FramePointer pointer = pointer_at(volume.times, time_s);
  const size_t frame = volume.whole ? 0 : size_t(pointer.frame);
  const size_t next = (frame + 1) % volume.frames.size();
  const MotionMap* map = nullptr;
  if (!volume.whole && !volume.motions.empty() && frame < volume.motions[0].steps.size())
    map = volume.motions[0].steps[frame].get();
  std::optional<SequenceMoment> whole;
  if (volume.whole) whole.emplace(*volume.whole, volume.whole->basis().at(time_s));
  const auto displaced = [&](glm::dvec3 x) -> glm::dvec3 {
    if (whole) return whole->displacement(x);
    return map ? pointer.phase * map->displacement(x) : glm::dvec3(0.0);
  };
  moved.values.grid = grid_of(*samples.place, most_samples);
  const Grid& grid = moved.values.grid;
  moved.values.values.reserve(grid.count());
  moved.moved_mm.reserve(grid.count());
  const FrameData &a = *volume.frames[frame], &b = *volume.frames[next];
  for (int k = 0; k < grid.size.z && !stop.stop_requested(); ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 mm = grid.lps_from_index({i, j, k});
        const glm::dvec3 y = 1e-3 * glm::dvec3(mm.x, mm.z, -mm.y);
        glm::dvec3 x = y;
        for (int n = 0; n < kSteps; ++n) {
          const glm::dvec3 better = y - displaced(x);
          const bool done = glm::length(better - x) < kInverted_m;
          x = better;
          if (done) break;
        }
        double value = a.scalar(x);
        if (!whole && pointer.phase > 0.0) {
          const glm::dvec3 there = x + (map ? map->displacement(x) : glm::dvec3(0.0));
          value += pointer.phase * (b.scalar(there) - value);
        }
        moved.values.values.push_back(float(value));
        moved.moved_mm.emplace_back(1e3 * lps(y - x));
      }
  return moved;
}

Result<std::unique_ptr<FeltServer>> FeltServer::start(uint16_t port) {
  auto server = openigtlink::Server::start(port);
  if (!server) return server.error();
  auto felt = std::unique_ptr<FeltServer>(new FeltServer);
  felt->server_ = std::move(*server);
  return felt;
}

void FeltServer::begin(Session& session) {
  places_ = std::make_unique<Background>(kPlaces, [this, &session] { send_places(session); });
  images_ = std::jthread([this, &session](std::stop_token stop) { send_images(stop, session); });
}

void FeltServer::end() {
  images_.request_stop();
  if (images_.joinable()) images_.join();
  places_.reset();
}

void FeltServer::send_places(Session& session) {
  SceneMoment moment;
  if (!session.newest(MomentReader::kServer, moment)) return;
  {
    const std::lock_guard lock(mutex_);
    moment_ = moment;
  }
  if (server_->clients() == 0 || moment.volume_count == 0) return;
  const Transform& place = moment.volumes[0].world_from_volume;
  const glm::dvec3 proxy_mm = 1e3 * lps(place.volume_from_world(moment.proxy_m));
  const glm::dvec3 force_n = lps(glm::conjugate(place.rotation) * moment.force_n);
  const auto send = [&](openigtlink::Bytes bytes) {
    server_->send(std::make_shared<const openigtlink::Bytes>(std::move(bytes)));
  };
  send(openigtlink::write_transform("palpate_proxy", now_s(), at(proxy_mm)));
  send(openigtlink::write_force("palpate_force", now_s(), force_n));
  if (++ticks_ % 10 == 1)
    send(openigtlink::write_status("palpate", now_s(), moment.cause == Cause::kNone ? 1 : 13,
                                   moment.cause == Cause::kNone ? "felt" : sentence(moment.cause)));
}

void FeltServer::send_images(std::stop_token stop, Session& session) {
  setpriority(PRIO_PROCESS, id_t(gettid()), 10);
  std::shared_ptr<const MovingVolume> last;
  double last_s = -1.0;
  size_t last_clients = 0;
  while (!stop.stop_requested()) {
    std::this_thread::sleep_for(100ms);
    SceneMoment moment;
    {
      const std::lock_guard lock(mutex_);
      moment = moment_;
    }
    const size_t clients = server_->clients();
    if (clients == 0 || moment.volume_count == 0) continue;
    const auto volume = session.scene()->volumes[0].data;
    const double time_s = moment.volumes[0].time_s;
    // The same again only for those who are new.
    if (volume == last && std::abs(time_s - last_s) < 1e-3 && clients <= last_clients) continue;
    last = volume;
    last_s = time_s;
    last_clients = clients;
    const MovedVolume moved = moved_volume(*volume, time_s, kMostSamples, stop);
    if (moved.values.values.size() != moved.values.grid.count() || moved.values.values.empty())
      continue;
    std::vector<float> vectors;
    for (const glm::vec3& u : moved.moved_mm)
      vectors.insert(vectors.end(), {-u.x, -u.y, u.z});  // RAS
    const Grid& grid = moved.values.grid;
    server_->send(std::make_shared<const openigtlink::Bytes>(
        openigtlink::write_image("palpate_volume", now_s(), grid, moved.values.values)));
    server_->send(std::make_shared<const openigtlink::Bytes>(
        openigtlink::write_image("palpate_motion", now_s(), grid, vectors, 3)));
    for (int n = 0; n < 4 && !stop.stop_requested(); ++n)
      std::this_thread::sleep_for((kImages - 100ms) / 4);
  }
}

}  // namespace palpate::app
