#pragma once

#include <memory>

#include "compute/volume/volume.h"
#include "integration/running/felt_server.h"
#include "integration/running/flight_recorder.h"
#include "integration/running/live_source.h"
#include "integration/running/tool_source.h"
#include "module/haptics/servo/position_source.h"
#include "module/session/session.h"

namespace palpate::running {

/// A Session with its device and what is connected to it while it runs. Whoever runs one (the
/// program, the C library) fills in what is wanted, and calls start(). In which order all of it
/// begins and ends stands here.
class ConnectedSession {
 public:
  ConnectedSession() = default;
  /// As stop().
  ~ConnectedSession() { stop(); }
  ConnectedSession(const ConnectedSession&) = delete;
  ConnectedSession& operator=(const ConnectedSession&) = delete;

  std::unique_ptr<ForceDevice> device;  ///< null where the host ticks
  FlightRecorder flight;                ///< hears every tick
  std::unique_ptr<ToolSource> tool;     ///< moves `tool_hand`; null: no tracked tool is the hand
  PositionSource* tool_hand = nullptr;  ///< the device, where there is a tool
  std::unique_ptr<LiveSource> live;     ///< its frames are felt; null: none come
  std::unique_ptr<FeltServer> server;   ///< null: nothing is served
  std::unique_ptr<ForceDevice> second_device;  ///< of a second hand; null: there is none
  FlightRecorder second_flight;                ///< hears every tick of it
  std::unique_ptr<Session> second;             ///< its session, after start()
  std::unique_ptr<Session> session;            ///< after start()

  /// Starts the servo thread, then what is connected. The first listener of the servo loop becomes
  /// `flight`. first_frame: of the live source, where another one has loaded the scene. As
  /// Session::start().
  Status start(const LoadedScene& scene, SessionOptions options,
               const Volume* first_frame = nullptr);
  /// Before it, for a second hand with `second_device`: starts its session, with the first one's
  /// options but those of its device. As Session::start().
  Status start_second(const LoadedScene& scene, SessionOptions options);
  /// The same for a host that ticks with a device of its own.
  Status start_in_host(const LoadedScene& scene, const DeviceInfo& of_host, SessionOptions options,
                       const Volume* first_frame = nullptr);

  /// The force goes to zero, then no frame is taken and nothing is served any more. Viewers of the
  /// session may end later. Further calls do nothing. One thread at a time.
  void stop();

 private:
  Status begin(Result<std::unique_ptr<Session>> started, const LoadedScene& scene,
               const Volume* first_frame);
};

/// How late a tick may be. 0: the usual, which is more for a hand that no force can hurt, since the
/// machine may be busy: a simulated one, or one that feels no force.
void set_watchdog(SessionOptions& options, double watchdog_s, bool is_harmless);

}  // namespace palpate::running
