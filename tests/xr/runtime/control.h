#pragma once

#include <openxr/openxr.h>
#include <vulkan/vulkan.h>

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

/// The interface of a test to the fault-injecting OpenXR runtime in the same process. The runtime
/// is a shared library that the OpenXR loader finds by XR_RUNTIME_JSON. Another program (hello_xr),
/// which does not use this header, gets the defaults and these
/// environment variables:
///   PALPATE_FAKE_XR_FRAMES      the session ends after so many
///   PALPATE_FAKE_XR_QUAD_VIEWS  there are such
///   PALPATE_FAKE_XR_MODEL       a file with the controllers' shape, a binary glTF
///   PALPATE_FAKE_XR_WITHOUT     an extension that is not offered
///   PALPATE_FAKE_XR_REPORT      a file for the report at the end
///   PALPATE_FAKE_XR_REAL_TIME, PALPATE_FAKE_XR_REMOTE   see remote.h
namespace palpate::test::fake {

/// XR_REFERENCE_SPACE_TYPE_LOCAL_FLOOR_EXT, which is not in Debian 12's headers.
constexpr XrReferenceSpaceType kLocalFloor = XrReferenceSpaceType(1000426000);

/// The properties of the runtime. Read when an instance, system or session is created.
struct Setup {
  /// By default all that are implemented.
  std::vector<std::string> extensions;
  std::vector<int64_t> formats;  ///< of swapchains, in order of preference
  /// kLocalFloor is offered only to those who enable XR_EXT_local_floor.
  std::vector<XrReferenceSpaceType> spaces;
  std::vector<XrEnvironmentBlendMode> blend_modes;
  uint32_t view_width = 64, view_height = 48;
  /// Offers XR_VIEW_CONFIGURATION_TYPE_PRIMARY_QUAD_VARJO to those who enable its extension: a
  /// second pair of views, of this size, in the middle of the first.
  bool quad_views = false;
  uint32_t focus_width = 80, focus_height = 72;
  /// That pair can follow the gaze: then it has this size, and its middle is at this angle to the
  /// right, radians, while the gaze is seen.
  bool foveation = false, gaze_seen = true;
  uint32_t gaze_width = 56, gaze_height = 40;
  float gaze = 0.1F;
  double rate_hz = 90.0;
  /// Of the display, that programs may choose from (XR_FB_display_refresh_rate).
  std::vector<float> rates_hz = {72.0F, 90.0F, 120.0F};
  bool headset_on = true;  ///< false: FORM_FACTOR_UNAVAILABLE
  bool runtime_up = true;  ///< false: xrCreateInstance gives RUNTIME_FAILURE
  /// sessions only with the last VkDevice made through this instance
  bool own_devices_only = false;
  /// devices only of a VkInstance made through this instance; else VALIDATION_FAILURE, as Monado
  /// 25.0.1 answers
  bool own_vulkan_only = false;
  bool automatic = true;  ///< the session's states come by themselves
  bool should_render = true;
  /// The parts of each view that the optics hide, in the view's plane z = -1: triangles, one after
  /// the other.
  std::vector<XrVector2f> hidden = {{-1, 1}, {-0.6F, 1}, {-1, 0.6F},
                                    {1, -1}, {0.6F, -1}, {1, -0.6F}};
  bool keep_pictures = false;  ///< read the projection layer back at xrEndFrame
  bool sees_hands = true;      ///< the headset has hand tracking
  bool tracked = true;         ///< false: poses are not valid
  /// The shape of either controller, a binary glTF of which the node "trigger" is told to move: to
  /// this height in the grip, m.
  std::vector<uint8_t> model;
  float trigger_y = -0.04F;
  bool shows_trigger = true;
  /// The smallest supported Vulkan 1.x.
  uint32_t vulkan_minor = 0;
  /// Requests the end of the session after so many frames; 0: never.
  uint64_t end_after_frames = 0;
  std::string profile = "/interaction_profiles/khr/simple_controller";
};

struct Picture {
  uint32_t width = 0, height = 0;
  VkFormat format = VK_FORMAT_UNDEFINED;
  /// As stored, one word per pixel; two for half floats.
  std::vector<uint32_t> rgba;
  /// The values that a compositor reads: linear light R, G, B, and the coverage.
  std::vector<std::array<float, 4>> light;
  std::vector<float> depth;  ///< empty without a depth layer
  float near_m = 0, far_m = 0;
};

struct Haptic {
  std::string action;
  XrPath hand = 0;
  float amplitude = 0;
  int64_t duration_ns = 0;
};

/// A frame at xrEndFrame.
struct Ended {
  XrTime display_time = 0;
  XrEnvironmentBlendMode blend{};
  uint32_t layers = 0;
  bool depth = false;
  XrCompositionLayerFlags flags = 0;
  XrReferenceSpaceType space{};
  XrPosef eyes[4]{};
};

/// A quad layer of a frame, with its picture if pictures are kept.
struct Quad {
  Picture picture;
  XrPosef pose{};
  XrExtent2Df size{};
  XrReferenceSpaceType space{};
};

/// Tracking data of a hand without a controller.
struct SeenFingers {
  XrVector3f thumb_tip{}, index_tip{};  ///< room, m
  XrSpaceLocationFlags flags = 0xF;     ///< of both: valid and tracked
  float radius = 0.008F;                ///< of a fingertip, m
};
/// None: the hand is not tracked.
using FingerScript = std::function<std::optional<SeenFingers>(XrTime)>;

using PoseScript = std::function<XrPosef(XrTime)>;

class Control {
 public:
  virtual ~Control() = default;
  /// Back to the defaults; there must be no instance.
  virtual void reset() = 0;
  virtual Setup& setup() = 0;

  /// The nth call (from 1) of `function` from now on returns `result` and does nothing else. After
  /// INSTANCE_LOST and SESSION_LOST all objects below fail in this way until they are destroyed, as
  /// with a real runtime.
  virtual void inject(const std::string& function, int nth, XrResult result) = 0;
  /// The same for all later calls.
  virtual void inject_always(const std::string& function, XrResult result) = 0;
  /// Whether every injection has happened.
  virtual bool injected_all() const = 0;
  virtual int calls(const std::string& function) const = 0;
  virtual const std::map<std::string, int>& all_calls() const = 0;

  /// All errors in how the runtime was called.
  virtual std::vector<std::string> violations() const = 0;
  /// Live handles, by kind; empty if all were destroyed.
  virtual std::string alive() const = 0;

  virtual void announce(XrSessionState state) = 0;  ///< of the newest session
  /// An event, then every call fails with it.
  virtual void lose_instance() = 0;
  virtual void lose_session() = 0;
  /// The runtime changes the display's rate by itself.
  virtual void change_rate(double hz) = 0;
  /// An event: other controllers are held.
  virtual void change_models() = 0;
  virtual void push_event(const XrEventDataBuffer& event) = 0;
  virtual XrSession session() const = 0;  ///< the newest, or null
  virtual XrSessionState state() const = 0;
  virtual int64_t overlay() const = 0;  ///< place of the newest session among overlays; -1: none
  /// The origin of a space moves at `time`: poseInPreviousSpace as given. Poses located later are
  /// in the new space. `say_pose` false: poseValid is false. With LOCAL goes kLocalFloor, which
  /// has an event of its own, and stays at the stage's height.
  virtual void recentre(XrReferenceSpaceType space, XrTime time, const XrPosef& pose,
                        bool say_pose) = 0;

  /// Poses in the room, which never moves.
  virtual void script_head(PoseScript room_from_head) = 0;
  virtual void script_hand(int hand, PoseScript room_from_hand) = 0;
  /// Null: never tracked, as at the start.
  virtual void script_fingers(int hand, FingerScript fingers) = 0;
  virtual void set_input(const std::string& path, float value) = 0;  ///< full path of the part
  /// room_from_space now, of reference spaces.
  virtual XrPosef room_from(XrReferenceSpaceType space, XrTime time) const = 0;

  virtual XrTime now() const = 0;  ///< of the virtual clock
  virtual int64_t monotonic_of(XrTime time) const = 0;
  virtual uint64_t frames() const = 0;  ///< ended
  virtual Ended last_frame() const = 0;
  virtual std::vector<Picture> pictures()
      const = 0;                                ///< of the last frame with layers, one per view
  virtual std::vector<Quad> quads() const = 0;  ///< of the last frame
  virtual std::vector<Haptic> haptics() const = 0;
  virtual int stops() const = 0;  ///< xrStopHapticFeedback calls
};

/// The one runtime of this process.
__attribute__((visibility("default"))) Control& control();

}  // namespace palpate::test::fake
