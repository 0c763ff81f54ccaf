#include "integration/running/tool_source.h"

#include <fmt/format.h>

#include <chrono>

#include "module/haptics/servo/monotonic.h"
#include "module/scene/drive.h"

namespace palpate::running {
namespace {

constexpr std::chrono::milliseconds kPause{4};
constexpr int64_t kShortest_ns = 20'000'000;  // transforms of one packet give no speed
constexpr double kArm_m = 1.0;                // distance from the scene up to which it is followed
constexpr double kSpeed_m_per_s = 1.4;        // above real movements, below what the guards damp

Transform place_at_start(const SceneSpec& spec) {
  const VolumeSpec& first = spec.volumes.front();
  return driven(first.drive, first.transform, 0.0);
}

}  // namespace

PositionSourceOptions tool_probe() {
  PositionSourceOptions options;
  options.kind = "tool";
  options.waits = true;
  options.workspace_radius_m = kArm_m;
  options.speed_m_per_s = kSpeed_m_per_s;
  return options;
}

void stand_in_true_size(LoadedScene& scene) {
  const FrameData& frame = *scene.data.front()->frames.front();
  scene.spec.world_from_device = {};
  scene.spec.world_from_device.translation_m =
      place_at_start(scene.spec).world_from_volume(0.5 * (frame.low_m() + frame.high_m()));
}

Result<std::unique_ptr<ToolSource>> ToolSource::open(
    const std::string& address, const std::string& tool,
    std::function<void(const std::string&)> on_note) {
  const auto at = openigtlink::read_address(address);
  if (!at) return at.error();
  auto source = std::unique_ptr<ToolSource>(new ToolSource);
  openigtlink::ClientOptions client;
  client.transform = tool;
  client.first_transform = tool.empty();
  client.on_transform = [s = source.get()](const openigtlink::Rigid& rigid) { s->take(rigid); };
  client.on_note = std::move(on_note);
  auto started = openigtlink::Client::start(*at, std::move(client));
  if (!started) return started.error();
  source->client_ = std::move(*started);
  return source;
}

ToolSource::~ToolSource() {
  end();
}

void ToolSource::take(const openigtlink::Rigid& rigid) {
  const int64_t now_ns = monotonic_ns();
  const std::lock_guard lock(mutex_);
  if (heard_ns_ != 0) {
    const double seconds = 1e-9 * double(std::max(now_ns - heard_ns_, kShortest_ns));
    const double way_m = 1e-3 * glm::distance(rigid.translation_mm, tip_lps_mm_);
    if (way_m > kFastest_m_per_s * seconds) {
      jumped_ = true;
      ++jumps_;
    }
  }
  tip_lps_mm_ = rigid.translation_mm;
  heard_ns_ = now_ns;
}

void ToolSource::begin(PositionSource& probe, const SceneSpec& spec) {
  world_from_volume_ = place_at_start(spec);
  world_from_device_ = spec.world_from_device;
  moves_ = std::make_unique<Background>(kPause, [this, &probe] { move(probe); });
}

/// On one thread only, since a probe is moved by one thread.
void ToolSource::move(PositionSource& probe) {
  glm::dvec3 tip_mm;
  bool there = false;
  {
    const std::lock_guard lock(mutex_);
    there = heard_ns_ != 0 && monotonic_ns() - heard_ns_ < kSilence_ns && !jumped_;
    jumped_ = false;
    tip_mm = tip_lps_mm_;
  }
  if (!there) return probe.let_go();
  const glm::dvec3 world = world_from_volume_.world_from_volume(volume_from_lps(tip_mm));
  probe.hold(world_from_device_.volume_from_world(world), 0);
}

void ToolSource::end() {
  moves_.reset();
  if (!client_) return;
  numbers_ = client_->numbers();
  client_.reset();
}

std::string ToolSource::summary() const {
  const std::lock_guard lock(mutex_);
  std::string text =
      fmt::format("Tool      {} transforms came, {} of them jumped", numbers_.transforms, jumps_);
  for (const auto& [reason, count] : numbers_.refused)
    text += fmt::format("\n          {} refused: {}", count, reason);
  if (numbers_.connections > 1)
    text += fmt::format("\n          {} connections", numbers_.connections);
  return text;
}

}  // namespace palpate::running
