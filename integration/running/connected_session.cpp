#include "integration/running/connected_session.h"

#include <algorithm>
#include <utility>

namespace palpate::running {
namespace {

constexpr double kWatchdog_s = 0.005, kHarmlessWatchdog_s = 0.05;

}  // namespace

Status ConnectedSession::start(const LoadedScene& scene, SessionOptions options,
                               const Volume* first_frame) {
  options.servo.listeners[0] = flight.listener();
  options.second = second.get();
  return begin(Session::start(scene, *device, std::move(options)), scene, first_frame);
}

Status ConnectedSession::start_second(const LoadedScene& scene, SessionOptions options) {
  // Motion is estimated once, and comes from the first session; so do poses and commands.
  options.is_second = true;
  options.motion.open_context = {};
  options.second_hand = nullptr;
  options.tube_buttons = 0;
  options.on_event = {};
  options.next_note = {};
  options.servo.listeners = {second_flight.listener()};
  options.servo.real_time.core = -1;
  auto started = Session::start(scene, *second_device, std::move(options));
  if (!started) return started.error();
  second = std::move(*started);
  return Nothing{};
}

Status ConnectedSession::start_in_host(const LoadedScene& scene, const DeviceInfo& of_host,
                                       SessionOptions options, const Volume* first_frame) {
  options.servo.listeners[0] = flight.listener();
  return begin(Session::start_in_host(scene, of_host, std::move(options)), scene, first_frame);
}

Status ConnectedSession::begin(Result<std::unique_ptr<Session>> started, const LoadedScene& scene,
                               const Volume* first_frame) {
  if (!started) return started.error();
  session = std::move(*started);
  if (live) live->begin(*session, first_frame ? *first_frame : live->first());
  if (tool) tool->begin(*tool_hand, scene.spec);
  if (server) server->begin(*session);
  return Nothing{};
}

void ConnectedSession::stop() {
  if (!session) {
    if (second) second->stop();  // the first one could not be started
    return;
  }
  // The force first: the others may wait for a volume that is being computed.
  session->stop();
  if (server) server->end();
  if (live) live->end();
  if (tool) tool->end();
}

void set_watchdog(SessionOptions& options, double watchdog_s, bool is_harmless) {
  const double late_s = watchdog_s > 0.0 ? watchdog_s
                        : is_harmless    ? kHarmlessWatchdog_s
                                         : kWatchdog_s;
  SafetyOptions& safety = options.haptics.safety;
  safety.late_s = late_s;
  safety.stale_s = std::max(safety.stale_s, 2.0 * late_s);
  options.servo.loop.watchdog_ns = int64_t(1e9 * late_s);
}

}  // namespace palpate::running
