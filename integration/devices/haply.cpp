#include "integration/devices/haply.h"

#include <algorithm>

#include "integration/devices/haply_protocol.h"
#include "integration/devices/web_socket.h"
#include "module/haptics/servo/monotonic.h"

namespace palpate::devices {
namespace {

// Its maker publishes no largest force. Other clients clip at 5 N per axis.
constexpr double kHaplyForce_n = 3.0;
// The most that its maker's own examples offer.
constexpr double kHaplyStiffness_n_per_m = 800.0;
// Spheres that its maker's examples keep to.
constexpr double kInverse3Radius_m = 0.08, kMinverseRadius_m = 0.04;
// A position is taken in one period of the servo loop and used in the next.
constexpr double kHaplyDelay_s = 1e-3;
constexpr int64_t kEventsWait_ns = 100'000'000, kCloseWait_ns = 100'000'000;
// their socket is opened no more often than that
constexpr int64_t kEventsAgain_ns = 1'000'000'000;

class HaplyLink final : public DeviceLink {
 public:
  explicit HaplyLink(const HaplyOptions& options) : options_(options) {}

  DeviceFault open() override {
    socket_ = WebSocket::connect(options_.host, options_.port, options_.open_wait_ns);
    if (!socket_) return DeviceFault::kNotOpened;
    const DeviceFault fault = begin_session();
    if (fault != DeviceFault::kNone) socket_.reset();
    return fault;
  }

  DeviceInfo info() const override {
    DeviceInfo info;
    info.kind = "haply";
    const bool small = type_ == "minverse";
    info.name = small                  ? "Haply Minverse"
                : type_ == "inverse3x" ? "Haply Inverse3x"
                                       : "Haply Inverse3";
    if (!id_.empty()) info.address = id_;
    info.max_force_n = kHaplyForce_n;
    info.max_stiffness_n_per_m = kHaplyStiffness_n_per_m;
    // Before its type is known: what both can do.
    info.workspace_radius_m = small || type_.empty() ? kMinverseRadius_m : kInverse3Radius_m;
    info.delay_s = kHaplyDelay_s;
    info.buttons = 3;
    return info;
  }

  LinkAnswer exchange(glm::dvec3 force_n) override {
    LinkAnswer answer;
    // What came since the last exchange is too late to answer this one.
    while (socket_->receive(0)) owed_ = std::max(0, owed_ - 1);
    if (socket_->send(haply::force_message(id_, force_n, wording_))) ++owed_;
    take_answers(answer);
    heed_events(answer);
    if (said_ != DeviceFault::kNone && answer.said == DeviceFault::kNone) answer.said = said_;
    if (answer.said == DeviceFault::kUnplugged) answer.lost = true;
    if (!socket_->is_open()) {
      answer.lost = true;
      if (socket_->was_flooded()) answer.said = DeviceFault::kGarbage;
    }
    return answer;
  }

  void close() noexcept override {
    try {
      // A force holds for one message only; zero is sent last all the same.
      if (socket_ && socket_->send(haply::force_message(id_, glm::dvec3(0.0), wording_)))
        socket_->receive(kCloseWait_ns);
      if (socket_) socket_->close(kCloseWait_ns);
    } catch (...) {
    }
    socket_.reset();
    events_.reset();
  }

 private:
  DeviceFault begin_session() {
    const auto text = socket_->receive(options_.open_wait_ns);
    if (!text) return DeviceFault::kTimeout;
    const auto inventory = haply::state_of(*text);
    if (!inventory) return DeviceFault::kGarbage;
    const haply::DeviceState* device = wanted(*inventory);
    if (!device) return DeviceFault::kNotOpened;
    id_ = device->id;
    type_ = device->type.empty() ? "inverse3" : device->type;
    // Asked only here: later it is this session that uses the device.
    if (device->in_use.value_or(false)) return DeviceFault::kBusy;
    if (const DeviceFault fault = fault_of(*device); fault != DeviceFault::kNone) return fault;

    const auto body = http_get(options_.host, options_.port, "/version", options_.open_wait_ns);
    const haply::Version version = body ? haply::version_of(*body) : haply::Version();
    wording_ = haply::wording_of(version);
    has_presets_ = haply::has_presets(version);
    owed_ = 0;
    said_ = DeviceFault::kNone;
    events_again_ns_.reset();
    if (!socket_->send(haply::first_message(id_, version))) return DeviceFault::kTransfer;
    const auto first = socket_->receive(options_.open_wait_ns);
    if (!first) return DeviceFault::kTimeout;
    if (!place_origin()) return DeviceFault::kGarbage;
    // Old services give none; then what the states say must do.
    events_tried_ns_ = monotonic_ns();
    if (options_.events_port)
      events_ = WebSocket::connect(options_.host, options_.events_port, kEventsWait_ns);
    return DeviceFault::kNone;
  }

  /// Zero force, and the place from which positions are counted.
  bool place_origin() {
    if (!socket_->send(haply::force_message(id_, glm::dvec3(0.0), wording_))) return false;
    const auto text = socket_->receive(options_.open_wait_ns);
    const auto state = text ? haply::state_of(*text) : std::nullopt;
    const haply::DeviceState* device = state ? mine(*state) : nullptr;
    if (!device || !device->position_m) return false;
    if (!has_presets_ && !origin_m_) origin_m_ = device->position_m;
    return true;
  }

  /// Until every message has its answer, or the time is over.
  void take_answers(LinkAnswer& answer) {
    const int64_t end_ns = monotonic_ns() + options_.answer_wait_ns;
    bool any = false;
    LinkAnswer newest;
    while (owed_ > 0) {
      const auto text = socket_->receive(std::max<int64_t>(0, end_ns - monotonic_ns()));
      if (!text) break;
      --owed_;
      any = true;
      newest = read(*text);
      answer.garbage |= newest.garbage;
    }
    if (owed_ == 0 && any) {
      newest.garbage = answer.garbage;
      answer = newest;
    }
    // Some came and the rest did not within the time: they are lost, or taken for that.
    if (any) owed_ = 0;
  }

  LinkAnswer read(const std::string& text) const {
    LinkAnswer answer;
    const auto state = haply::state_of(text);
    if (!state) {
      answer.garbage = true;
      return answer;
    }
    const haply::DeviceState* device = mine(*state);
    if (!device) {
      answer.said = DeviceFault::kUnplugged;
      return answer;
    }
    answer.said = fault_of(*device);
    answer.buttons = state->buttons;
    if (device->position_m) {
      answer.answered = true;
      answer.position_m = *device->position_m - origin_m_.value_or(glm::dvec3(0.0));
    } else {
      answer.garbage = true;
    }
    return answer;
  }

  void heed_events(LinkAnswer& answer) {
    listen_again();
    while (events_) {
      const auto text = events_->receive(0);
      if (!text) break;
      const haply::DeviceEvent event = haply::event_of(*text);
      if (!event.id.empty() && event.id != id_) continue;
      switch (event.event) {
        case haply::Event::kDisconnected:
          said_ = DeviceFault::kUnplugged;
          break;
        case haply::Event::kBrakeOn:
          said_ = DeviceFault::kForceOff;
          break;
        case haply::Event::kBrakeOff:
        case haply::Event::kConnected:
          said_ = DeviceFault::kNone;
          break;
        case haply::Event::kStalled:
          answer.said = DeviceFault::kStuck;
          break;
        case haply::Event::kNotCalibrated:
          answer.said = DeviceFault::kNotHomed;
          break;
        case haply::Event::kBusy:
          answer.said = DeviceFault::kBusy;
          break;
        case haply::Event::kOther:
          break;
      }
    }
    if (events_ && !events_->is_open()) {
      events_.reset();
      // At once where it has lasted: what is said meanwhile nobody hears.
      events_again_ns_ = events_tried_ns_ + kEventsAgain_ns;
    }
  }

  /// After the socket of the events broke. What was said holds until an event says otherwise, or
  /// the device is unplugged: the brake is still on, as far as anybody knows, since no state says
  /// it.
  void listen_again() {
    if (!events_again_ns_ || monotonic_ns() < *events_again_ns_) return;
    // Within an exchange, so it has the time of an answer. A port that nobody listens at says so at
    // once.
    events_tried_ns_ = monotonic_ns();
    events_ = WebSocket::connect(options_.host, options_.events_port, options_.answer_wait_ns);
    if (events_)
      events_again_ns_.reset();
    else
      events_again_ns_ = events_tried_ns_ + kEventsAgain_ns;
  }

  static DeviceFault fault_of(const haply::DeviceState& device) {
    if (!device.powered.value_or(true) || !device.ready.value_or(true))
      return DeviceFault::kStarting;
    if (!device.calibrated.value_or(true)) return DeviceFault::kNotHomed;
    return DeviceFault::kNone;
  }

  const haply::DeviceState* wanted(const haply::HaplyState& state) const {
    for (const haply::DeviceState& device : state.devices)
      if (!device.id.empty() && (options_.device_id.empty() || options_.device_id == device.id))
        return &device;
    return nullptr;
  }

  const haply::DeviceState* mine(const haply::HaplyState& state) const {
    const auto found = std::find_if(state.devices.begin(), state.devices.end(),
                                    [&](const auto& device) { return device.id == id_; });
    return found == state.devices.end() ? nullptr : &*found;
  }

  const HaplyOptions options_;
  std::unique_ptr<WebSocket> socket_, events_;
  std::string id_, type_;
  haply::Wording wording_ = haply::Wording::kVector;
  bool has_presets_ = true;
  std::optional<glm::dvec3> origin_m_;      ///< of a service without presets
  int owed_ = 0;                            ///< messages without an answer yet
  DeviceFault said_ = DeviceFault::kNone;   ///< by an event, until another one
  int64_t events_tried_ns_ = 0;             ///< when their socket was opened last
  std::optional<int64_t> events_again_ns_;  ///< when their socket is to be opened again; none: not
};

}  // namespace

std::unique_ptr<DeviceLink> make_haply_link(const HaplyOptions& options) {
  return std::make_unique<HaplyLink>(options);
}

bool haply_service_answers(const HaplyOptions& options) {
  return WebSocket::connect(options.host, options.port, kEventsWait_ns) != nullptr;
}

}  // namespace palpate::devices
