#include "module/xr/headset.h"

#include <algorithm>
#include <optional>

#include "module/xr/clock.h"
#include "module/xr/graphics.h"
#include "module/xr/live_session.h"

namespace palpate::xr {
namespace {

constexpr int64_t kFarewell = 2 * kSecond_ns;

HeadsetState state_of(const Lifecycle& life) {
  if (!life.running()) return HeadsetState::kIdle;
  if (life.focused()) return HeadsetState::kFocused;
  return life.visible() ? HeadsetState::kVisible : HeadsetState::kHidden;
}

BlendMode blend_of(XrEnvironmentBlendMode mode) {
  if (mode == XR_ENVIRONMENT_BLEND_MODE_ADDITIVE) return BlendMode::kAdditive;
  return mode == XR_ENVIRONMENT_BLEND_MODE_ALPHA_BLEND ? BlendMode::kAlpha : BlendMode::kOpaque;
}

}  // namespace

const char* name(HeadsetState state) {
  switch (state) {
    case HeadsetState::kNoRuntime:
      return "no runtime";
    case HeadsetState::kWaiting:
      return "waiting";
    case HeadsetState::kIdle:
      return "idle";
    case HeadsetState::kHidden:
      return "hidden";
    case HeadsetState::kVisible:
      return "visible";
    case HeadsetState::kFocused:
      return "focused";
    case HeadsetState::kEnded:
      return "ended";
  }
  return "";
}

const char* name(Origin origin) {
  switch (origin) {
    case Origin::kStage:
      return "stage";
    case Origin::kLocal:
      return "local";
    case Origin::kView:
      return "view";
    case Origin::kLocalFloor:
      return "local floor";
  }
  return "";
}

/// The members are in the order of the life cycle, so that they go in the opposite one.
class Headset::Story {
 public:
  Story(HeadsetOptions wanted, PictureSource& shown) : options(wanted), source(shown) {}
  ~Story() {
    drop_runtime();
    drop_context();
  }

  void step(int64_t now_ns);
  void end(int64_t now_ns);
  void look_again();

  const HeadsetOptions options;
  PictureSource& source;
  Report report;
  Colocation colocation;
  std::shared_ptr<vulkan::Context> context;
  std::unique_ptr<LiveSession> live;

 private:
  Done arrive();
  Done find_context();
  Done open_session();
  void take(const Round& round);
  void fail(const Problem& problem, int64_t now_ns);
  void rest(HeadsetState state, const std::string& sentence);
  void drop_runtime();
  void drop_context();
  int64_t pause_ns(Trouble trouble) const;

  std::optional<Instance> instance_;
  System system_;
  std::string said_;
  bool had_runtime_ = false, runtime_restarted_ = false;
  bool context_is_old_ = false;  ///< made for an earlier instance of the runtime
  bool insisted_ = false;        ///< a new device was tried since the last frame
  int64_t next_try_ns_ = INT64_MIN;
  int failures_in_a_row_ = 0;
  std::optional<int64_t> leave_at_ns_;
};

void Headset::Story::step(int64_t now_ns) {
  report.sentence.clear();
  report.hands = {};
  if (report.state == HeadsetState::kEnded || report.state == HeadsetState::kNoRuntime) return;
  if (leave_at_ns_ && now_ns >= *leave_at_ns_) {
    drop_runtime();
    return rest(HeadsetState::kEnded, "The headset was left: its runtime did not end the session.");
  }
  if (!live) {
    if (now_ns < next_try_ns_) return;
    const Done arrived = arrive();
    if (!arrived) return fail(arrived.error(), now_ns);
  }
  const Outcome<Round> done = live->round(source);
  if (!done) return fail(done.error(), now_ns);
  take(*done);
  if (done->duty == Duty::kDropLost) fail(problem_of("xrPollEvent", XR_ERROR_SESSION_LOST), now_ns);
}

void Headset::Story::take(const Round& round) {
  if (round.framed) {
    failures_in_a_row_ = 0;
    insisted_ = false;
    ++report.frames;
    report.hands = round.frame.hands;
    if (round.frame.drawn) {
      ++report.drawn;
      report.depth = round.frame.depth;
    }
  }
  if (round.duty == Duty::kDropEnded) {
    drop_runtime();
    return rest(HeadsetState::kEnded, "The session in the headset was ended.");
  }
  if (!live) return;
  report.state = state_of(live->session().life());
  report.main_visible = live->main_visible();
  report.hand_tracking = live->bare_hands();
  report.no_hand_tracking = live->tracking().refused();
  report.controller_models = live->models().works();
  report.no_controller_models = live->models().refused();
  report.no_panel = call_text(live->no_panel());
  report.display = live->display();
}

Done Headset::Story::arrive() {
  if (!instance_) {
    Outcome<Instance> made = Instance::make(options.overlay.has_value());
    if (!made) return made.error();
    instance_.emplace(std::move(*made));
    report.runtime = instance_->runtime();
    runtime_restarted_ = context_is_old_ = had_runtime_;
    had_runtime_ = true;
  }
  const Outcome<System> found = System::find(*instance_);
  if (!found) return found.error();
  system_ = *found;
  report.system = system_.name;
  Done ready = find_context();
  if (!ready) return ready;
  ready = open_session();
  if (ready || !context_is_old_ || insisted_) return ready;
  // The runtime may insist on a device that it made itself. This is tried once, because with a new
  // device everything has to be uploaded again.
  insisted_ = true;
  drop_context();
  ready = find_context();
  if (!ready) return ready;
  return open_session();
}

/// Keeps the device of an earlier session where the runtime still draws with the same GPU: all that
/// was loaded onto it stays. Otherwise makes one through the runtime.
Done Headset::Story::find_context() {
  if (context) {
    const Outcome<bool> same = still_drives(*instance_, system_, *context);
    if (!same) return same.error();
    if (*same) return Nothing{};
    drop_context();
  }
  const auto made =
      make_context(*instance_, system_, {options.validation, options.memory_cap_bytes});
  if (!made) return made.error();
  context = *made;
  context_is_old_ = false;
  const Status taken = source.use(context);
  if (taken) return Nothing{};
  drop_context();
  return of_device(taken.error());
}

Done Headset::Story::open_session() {
  auto made = LiveSession::make(*instance_, system_, context, options, colocation);
  if (!made) return made.error();
  live = std::move(*made);
  if (report.sessions > 0) colocation.begin_session(runtime_restarted_);
  runtime_restarted_ = false;
  next_try_ns_ = INT64_MIN;
  ++report.sessions;
  report.origin = live->origin();
  report.blend = blend_of(live->blend());
  report.see_through = live->see_through();
  report.main_visible = true;
  rest(HeadsetState::kIdle,
       "The headset is there: " + report.system + " through " + report.runtime + ".");
  return Nothing{};
}

void Headset::Story::rest(HeadsetState state, const std::string& sentence) {
  report.state = state;
  if (sentence == said_) return;
  said_ = report.sentence = sentence;
}

int64_t Headset::Story::pause_ns(Trouble trouble) const {
  if (trouble == Trouble::kUnsupported) return 5 * kSecond_ns;
  if (trouble != Trouble::kRefused && trouble != Trouble::kNoGraphics) return kSecond_ns;
  // What fails without a known reason may fail for ever: the pauses between attempts grow.
  return std::min<int64_t>(30, int64_t(1) << std::min(failures_in_a_row_, 5)) * kSecond_ns;
}

void Headset::Story::fail(const Problem& problem, int64_t now_ns) {
  live.reset();
  report.problem = problem;
  const Trouble trouble = problem.trouble;
  const bool only_session = trouble == Trouble::kSessionLost || trouble == Trouble::kNoHeadset;
  if (!only_session || leave_at_ns_) drop_runtime();
  if (trouble == Trouble::kNoGraphics) drop_context();
  if (leave_at_ns_) return rest(HeadsetState::kEnded, problem.message);
  if (trouble == Trouble::kNoRuntime && !had_runtime_)
    return rest(HeadsetState::kNoRuntime, problem.message);
  next_try_ns_ = now_ns + pause_ns(trouble);
  ++failures_in_a_row_;
  rest(HeadsetState::kWaiting, problem.message);
}

void Headset::Story::drop_runtime() {
  live.reset();
  instance_.reset();
}

void Headset::Story::drop_context() {
  if (!context) return;
  source.drop();
  context.reset();
}

void Headset::Story::end(int64_t now_ns) {
  if (leave_at_ns_) return;
  leave_at_ns_ = now_ns + kFarewell;
  const bool running = live && live->session().life().running();
  if (running && live->request_exit()) return;
  drop_runtime();
  rest(HeadsetState::kEnded, "The session in the headset was ended.");
}

void Headset::Story::look_again() {
  if (report.state != HeadsetState::kEnded && report.state != HeadsetState::kNoRuntime) return;
  report.state = HeadsetState::kWaiting;
  leave_at_ns_.reset();
  next_try_ns_ = INT64_MIN;
  failures_in_a_row_ = 0;
  said_.clear();
}

Headset::Headset(HeadsetOptions options, PictureSource& source)
    : story_(std::make_unique<Story>(options, source)) {}

Headset::~Headset() = default;

const Report& Headset::step(int64_t now_ns) {
  story_->step(now_ns);
  return story_->report;
}

const Report& Headset::report() const {
  return story_->report;
}

void Headset::look_again() {
  story_->look_again();
}

void Headset::end(int64_t now_ns) {
  story_->end(now_ns);
}

void Headset::vibrate(int hand, double amplitude) {
  // A refused vibration is only lost: if the runtime is gone, the next frame reports it.
  if (story_->live) (void)story_->live->vibrate(hand, amplitude);
}

Colocation& Headset::colocation() {
  return story_->colocation;
}

std::shared_ptr<vulkan::Context> Headset::context() const {
  return story_->context;
}

}  // namespace palpate::xr
