#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "integration/running/connected_session.h"
#include "integration/running/felt_device.h"
#include "integration/running/session_request.h"

namespace palpate::running {

/// Where a note comes from while a session is opened or runs.
enum class NoteSource : uint8_t { kTool, kLive };

/// Functions of the caller; each may be empty, and is called on any thread.
struct SessionCallbacks {
  /// Opens the device that estimates missing motion; empty: nothing is estimated. May be called
  /// more than once.
  std::function<Result<std::shared_ptr<vulkan::Context>>()> open_context;
  std::function<void(const SessionEvent&)> on_event;  ///< see SessionOptions::on_event
  std::function<std::string()> next_note;             ///< see SessionOptions::next_note
  std::function<void(NoteSource, const std::string&)> on_note;
  loading::OnDoing on_doing;  ///< a few words on the present step of reading
};

/// What a caller has that no option can say.
struct SessionHost {
  /// Read before by load_request(), maybe for several sessions; empty: the request's inputs are
  /// read.
  std::optional<LoadedScene> scene;
  std::optional<Volume> first_frame;    ///< of that scene, if it is live
  std::unique_ptr<ForceDevice> device;  ///< of the host; null: as the request says
  std::optional<DeviceInfo> ticks;      ///< the host ticks itself, with a device like this
  OtherHands others;                    ///< what can be the hand without a force device
  bool sums_up = false;                 ///< numbers and rows of all ticks are kept for a summary
};

/// A scene that was read, with the live source of its frames (null: none).
struct RequestedScene {
  LoadedScene scene;
  std::unique_ptr<LiveSource> live;
};

/// Reads the scene of a request: files, a built-in scene, or the first frame of a live source; and
/// applies the request's options of the scene. Errors: kBadInput with one sentence; kNoDevice if a
/// live source sends nothing. Any thread.
Result<RequestedScene> load_request(const SessionRequest& request,
                                    const SessionCallbacks& callbacks);
/// The same for a scene that was loaded otherwise: its options, in place.
void apply_scene_options(const SessionRequest& request, LoadedScene& scene);

/// The options that a scene file asks for in its section `session`, where no door has set them.
/// Errors: as set_options().
Status set_scene_options(SessionRequest& request, const SceneSpec& scene);

/// A session that is ready to start: everything is read and open, nothing moves. A caller may still
/// change scene and options.
struct PreparedSession {
  SessionRequest request;  ///< with the options of the scene file's section `session`
  LoadedScene scene;
  FeltDevice felt;                        ///< its device has gone to the ConnectedSession
  std::optional<FeltDevice> second_felt;  ///< likewise, of a second hand
  SessionOptions options;
  std::optional<Volume> first_frame;
  bool host_ticks = false;
  bool sums_up = false;
  bool leaves_motion_out = false;  ///< missing motion: it can not be estimated while recording
};

/// Reads the scene, opens what it is connected to (server, live source, tool, device) into
/// `connected`, and puts the options of the loop together. Errors: kBadInput, kNoDevice,
/// kBadOutput, in one sentence. Any thread.
Result<PreparedSession> prepare_session(SessionRequest request, SessionHost host,
                                        SessionCallbacks callbacks, ConnectedSession& connected);
/// Opens the files that are written and starts the session, a second hand's before it: the forces
/// begin at zero. A second hand's table and recording are named beside the first's: second_file().
/// Errors:
/// kBadInput, kBadOutput.
Status start_session(PreparedSession& prepared, ConnectedSession& connected);

/// "run.second.ticks" for "run.ticks".
std::filesystem::path second_file(const std::filesystem::path& first);

/// Both, one after the other: from a request to a session that runs.
Status open_session(SessionRequest request, SessionHost host, SessionCallbacks callbacks,
                    ConnectedSession& connected);

}  // namespace palpate::running
