#include "integration/running/live_source.h"

#include <fmt/format.h>

#include <cmath>
#include <glm/gtc/quaternion.hpp>

namespace palpate::running {
namespace {

using openigtlink::Rigid;

/// A larger step between two transforms is no movement of a volume.
constexpr double kJump_mm = 20.0, kJump_rad = 0.35;

/// `to` relative to `from`: the motion in between.
Rigid between(const Rigid& from, const Rigid& to) {
  const glm::dmat3 rotation = to.rotation * glm::transpose(from.rotation);
  return {rotation, to.translation_mm - rotation * from.translation_mm};
}

/// LPS, mm, to volume space, m: x = L, y = S, z = -P.
Transform in_volume_space(const Rigid& lps) {
  const glm::dmat3 volume_from_lps(glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0, 1, 0));
  Transform moved;
  moved.rotation = glm::normalize(
      glm::quat_cast(volume_from_lps * lps.rotation * glm::transpose(volume_from_lps)));
  moved.translation_m = 1e-3 * (volume_from_lps * lps.translation_mm);
  return moved;
}

}  // namespace

Result<LoadedScene> live_scene(const std::string& name, const Volume& first,
                               const loading::SequenceChoices& choices, bool felt, bool placed,
                               const loading::OnDoing& doing) {
  // Used like the name of a file.
  std::string volume = name.empty() ? "live" : name;
  for (char& c : volume)
    if (c == '/' || c == '.') c = '_';
  auto given = std::make_shared<loading::GivenVolume>();
  given->frames = LiveSequence::standing(first);
  loading::SequenceChoices of_live = choices;
  of_live.given[volume] = given;
  of_live.wall = loading::FeltWall::kValues;  // there is no motion that would carry another wall
  of_live.cyclic = true;
  of_live.values = CarriedValues::kOwn;
  of_live.frames_per_second = 0.0;
  auto scene = felt ? loading::load_scene({volume}, of_live, doing)
                    : loading::load_shown_scene({volume}, of_live, doing);
  if (!scene) return scene;
  LiveSequence::prepare(*scene, 0);
  if (placed) make_movable(*scene);
  return scene;
}

Result<std::unique_ptr<LiveSource>> LiveSource::open(const std::string& address,
                                                     LiveSourceOptions options) {
  const auto at = openigtlink::read_address(address);
  if (!at) return at.error();
  auto source = std::unique_ptr<LiveSource>(new LiveSource(std::move(options)));
  source->address_ = fmt::format("{}:{}", at->host, at->port);
  openigtlink::ClientOptions client;
  client.image = source->options_.image;
  client.transform = source->options_.transform;
  client.on_image = [s = source.get()](openigtlink::ArrivedImage image) {
    s->take(std::move(image));
  };
  client.on_transform = [s = source.get()](const Rigid& rigid) { s->take(rigid); };
  client.on_note = [s = source.get()](const std::string& note) { s->say(note); };
  auto started = openigtlink::Client::start(*at, std::move(client));
  if (!started) return started.error();
  source->client_ = std::move(*started);
  return source;
}

LiveSource::~LiveSource() {
  end();
}

void LiveSource::say(const std::string& sentence) {
  if (options_.on_note) options_.on_note(sentence);
}

void LiveSource::take(openigtlink::ArrivedImage image) {
  LiveSequence* sequence = nullptr;
  {
    const std::lock_guard lock(mutex_);
    sequence = sequence_.get();
    if (!sequence) {
      newest_ = std::move(image);
      changed_.notify_all();
      return;
    }
  }
  // end() stops this thread before it deletes the sequence.
  sequence->push(image.volume, image.arrived_ns);
}

/// The first transform is the place of the volume; later ones move it from there. A jump moves
/// nothing: the volume continues from its place.
void LiveSource::take(const Rigid& rigid) {
  const std::lock_guard lock(mutex_);
  if (!session_) return;
  if (at_) {
    const Rigid step = between(*at_, rigid);
    const double angle = std::acos(std::clamp(
        0.5 * (step.rotation[0][0] + step.rotation[1][1] + step.rotation[2][2] - 1.0), -1.0, 1.0));
    if (angle > kJump_rad || glm::length(rigid.translation_mm - at_->translation_mm) > kJump_mm) {
      if (++jumps_ == 1)
        say("A transform jumped: the volume stays where it is, and goes on from there.");
      start_ = placed_;
      from_ = rigid;
    }
  } else {
    from_ = rigid;
  }
  at_ = rigid;
  const Transform moved = in_volume_space(between(*from_, rigid));
  placed_ = start_;
  placed_.translation_m = start_.world_from_volume(moved.translation_m);
  placed_.rotation = glm::normalize(start_.rotation * moved.rotation);
  session_->place(0, placed_);
}

Result<LoadedScene> LiveSource::load(const loading::SequenceChoices& choices, bool felt,
                                     const loading::OnDoing& doing, double most_s) {
  using Clock = std::chrono::steady_clock;
  const auto begun = Clock::now();
  openigtlink::ArrivedImage first;
  {
    std::unique_lock lock(mutex_);
    while (!newest_) {
      const bool connected = client_->is_connected();
      if (doing)
        doing(connected ? "waiting for the first image from " + address_
                        : "waiting for " + address_);
      if (most_s > 0.0 && std::chrono::duration<double>(Clock::now() - begun).count() > most_s)
        return Error{
            ErrorKind::kNoDevice,
            fmt::format("{} {} within {:.3g} s: start the OpenIGTLink server that sends "
                        "the images, or wait longer",
                        address_, connected ? "has sent no image" : "does not answer", most_s)};
      changed_.wait_for(lock, std::chrono::milliseconds(200),
                        [this] { return newest_.has_value(); });
    }
    first = std::move(*newest_);
    newest_.reset();
    first_ = first.volume;
  }
  return live_scene(first.device, first.volume, choices, felt, !options_.transform.empty());
}

void LiveSource::begin(Session& session, const Volume& first) {
  const std::lock_guard lock(mutex_);
  LiveSequenceOptions options;
  options.preset = options_.preset;
  options.open_context = options_.open_context;
  options.keep_cycles = options_.keep_cycles;
  options.on_note = options_.on_note;
  sequence_ = std::make_unique<LiveSequence>(session, 0, first, std::move(options));
  session_ = &session;
  // A frame that arrived since load(); from now on the client's thread pushes.
  if (newest_) sequence_->push(newest_->volume, newest_->arrived_ns);
  newest_.reset();
  start_ = placed_ = session.scene()->volumes[0].spec.transform;
}

void LiveSource::end() {
  if (!client_) return;
  {
    const std::lock_guard lock(mutex_);
    session_ = nullptr;
  }
  // The client's thread has ended: no frame is pushed after this.
  client_numbers_ = client_->numbers();
  client_.reset();
  // Outside the lock: the sequence waits for its threads, and numbers() must not wait.
  std::unique_ptr<LiveSequence> ended;
  const std::lock_guard lock(mutex_);
  if (sequence_) last_numbers_ = sequence_->numbers();
  ended = std::move(sequence_);
}

LiveNumbers LiveSource::numbers() const {
  const std::lock_guard lock(mutex_);
  return sequence_ ? sequence_->numbers() : last_numbers_;
}

std::string LiveSource::live_text() const {
  const std::lock_guard lock(mutex_);
  if (!sequence_) return {};
  const LiveNumbers now = sequence_->numbers();
  if (now.cycle_s > 0.0) return fmt::format("cycle of {:.2f} s kept", now.cycle_s);
  if (now.felt == 0) return fmt::format("{} frames came", now.received);
  return fmt::format("{} of {} frames felt, {:.2f} s behind", now.felt, now.received,
                     now.delay_median_s);
}

std::string LiveSource::summary() const {
  const LiveNumbers& now = last_numbers_;
  std::string text =
      fmt::format("Live      {} images came, {} were felt", client_numbers_.images, now.felt);
  if (now.felt > 0)
    text += fmt::format(", {:.2f} s after they arrived (median; {:.2f} p95, {:.2f} most)",
                        now.delay_median_s, now.delay_p95_s, now.delay_most_s);
  if (now.newer_came > 0)
    text +=
        fmt::format("\n          {} were left out because a newer one had come", now.newer_came);
  if (now.kept > 0)
    text += fmt::format("\n          {} kept the pace of a cycle, whose motion is that of {}",
                        now.kept, now.cycles == 1 ? "one" : fmt::format("{} of them", now.cycles));
  if (now.elsewhere > 0)
    text += fmt::format("\n          {} lay elsewhere in space than the first one", now.elsewhere);
  for (const auto& [reason, count] : client_numbers_.refused)
    text += fmt::format("\n          {} refused: {}", count, reason);
  if (client_numbers_.transforms > 0)
    text += fmt::format("\n          {} transforms, {} of them jumped", client_numbers_.transforms,
                        jumps_);
  if (client_numbers_.connections > 1)
    text += fmt::format("\n          {} connections", client_numbers_.connections);
  return text;
}

}  // namespace palpate::running
