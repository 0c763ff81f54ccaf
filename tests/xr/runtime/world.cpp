#include "tests/xr/runtime/world.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <iterator>
#include <thread>

#include "tests/xr/made_glb.h"

namespace palpate::test::fake {
namespace {

XrPosef standing_head(XrTime time) {
  // A head that sways: 1.6 m high, 5 mm sideways at 0.5 Hz.
  const double phase = 2 * 3.14159265358979 * 0.5 * double(time) * 1e-9;
  return {{0, 0, 0, 1}, {float(0.005 * std::sin(phase)), 1.6F, 0.0F}};
}

Setup defaults() {
  Setup setup;
  setup.extensions = {XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME,
                      XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME,
                      XR_KHR_VISIBILITY_MASK_EXTENSION_NAME,
                      XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME,
                      XR_EXTX_OVERLAY_EXTENSION_NAME,
                      XR_EXT_HAND_TRACKING_EXTENSION_NAME,
                      "XR_EXT_local_floor",
                      "XR_EXT_hand_interaction",
                      XR_FB_DISPLAY_REFRESH_RATE_EXTENSION_NAME,
                      "XR_EXT_uuid",
                      "XR_EXT_render_model",
                      "XR_EXT_interaction_render_model",
                      XR_VARJO_QUAD_VIEWS_EXTENSION_NAME,
                      XR_VARJO_FOVEATED_RENDERING_EXTENSION_NAME};
  setup.formats = {VK_FORMAT_B8G8R8A8_SRGB, VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_R8G8B8A8_UNORM,
                   VK_FORMAT_D32_SFLOAT};
  setup.spaces = {XR_REFERENCE_SPACE_TYPE_VIEW, XR_REFERENCE_SPACE_TYPE_LOCAL,
                  XR_REFERENCE_SPACE_TYPE_STAGE, kLocalFloor,
                  XR_REFERENCE_SPACE_TYPE_COMBINED_EYE_VARJO};
  setup.blend_modes = {XR_ENVIRONMENT_BLEND_MODE_OPAQUE, XR_ENVIRONMENT_BLEND_MODE_ALPHA_BLEND};
  setup.model = made_controller();
  // For programs that do not use Control.
  if (const char* without = std::getenv("PALPATE_FAKE_XR_WITHOUT"))
    std::erase(setup.extensions, without);
  if (const char* path = std::getenv("PALPATE_FAKE_XR_MODEL")) {
    std::ifstream file(path, std::ios::binary);
    setup.model.assign(std::istreambuf_iterator<char>(file), {});
  }
  if (const char* frames = std::getenv("PALPATE_FAKE_XR_FRAMES"))
    setup.end_after_frames = uint64_t(std::atoll(frames));
  setup.quad_views = std::getenv("PALPATE_FAKE_XR_QUAD_VIEWS") != nullptr;
  return setup;
}

int64_t monotonic_ns() {
  return std::chrono::steady_clock::now().time_since_epoch().count();
}

bool is_lasting(XrResult result) {
  return result == XR_ERROR_INSTANCE_LOST || result == XR_ERROR_SESSION_LOST;
}

}  // namespace

void World::next_frame() {
  if (!real_time) {
    time += period();
    return;
  }
  const XrTime now = monotonic_ns();
  const XrTime next = std::max(now, time + period());
  std::this_thread::sleep_for(std::chrono::nanoseconds(next - now));
  time = next;
}

World& world() {
  // Never destroyed: programs may still call it while they end.
  static auto* one = new World;
  return *one;
}

Control& control() {
  return world();
}

const char* name(Kind kind) {
  constexpr const char* kNames[] = {"instance",     "session",      "space",
                                    "swapchain",    "action set",   "action",
                                    "hand tracker", "render model", "render model asset"};
  return kNames[size_t(kind)];
}

World::World() {
  real_time = std::getenv("PALPATE_FAKE_XR_REAL_TIME") != nullptr;
  reset();
  if (real_time) time = monotonic_ns();
}

void World::reset() {
  const std::lock_guard lock(mutex);
  settings = defaults();
  objects.clear();
  counts.clear();
  counters.clear();
  faults.clear();
  wrong.clear();
  events.clear();
  paths.clear();
  path_numbers.clear();
  parts.clear();
  changes.clear();
  inputs.clear();
  taps.clear();
  shown.clear();
  vibrations.clear();
  vibration_stops = 0;
  ended = {};
  hanging.clear();
  ended_frames = 0;
  time = kStart;
  head = standing_head;
  hands[0] = [](XrTime) { return XrPosef{{0, 0, 0, 1}, {-0.2F, 1.1F, -0.4F}}; };
  hands[1] = [](XrTime) { return XrPosef{{0, 0, 0, 1}, {0.2F, 1.1F, -0.4F}}; };
  fingers[0] = fingers[1] = nullptr;
}

void World::inject(const std::string& function, int nth, XrResult result) {
  faults[function].push_back({nth, result, false});
}

void World::inject_always(const std::string& function, XrResult result) {
  faults[function].push_back({1, result, true});
}

bool World::injected_all() const {
  for (const auto& [function, list] : faults)
    for (const Fault& fault : list)
      if (!fault.always) return false;
  return true;
}

int World::calls(const std::string& function) const {
  const auto at = counts.find(function);
  return at == counts.end() ? 0 : at->second;
}

std::string World::alive() const {
  std::map<std::string, int> kinds;
  for (const auto& [id, object] : objects) ++kinds[name(object->kind)];
  std::string text;
  for (const auto& [kind, count] : kinds) text += kind + " x" + std::to_string(count) + " ";
  return text;
}

XrResult World::violation(const std::string& what, XrResult result) {
  wrong.push_back(what);
  return result;
}

void World::remove(uint64_t id) {
  std::vector<uint64_t> below;
  for (const auto& [child, object] : objects)
    if (object->parent == id) below.push_back(child);
  for (const uint64_t child : below) remove(child);
  if (auto* chain = find<Swapchain>(Kind::kSwapchain, id)) {
    if (auto* session = find<Session>(Kind::kSession, chain->parent))
      for (SwapchainImage& image : chain->images) destroy_image(*session, image);
  }
  objects.erase(id);
}

Session* World::newest_session() {
  Session* newest = nullptr;
  for (const auto& [id, object] : objects)
    if (object->kind == Kind::kSession && (!newest || id > newest->id))
      newest = static_cast<Session*>(object.get());
  return newest;
}

XrSession World::session() const {
  Session* newest = const_cast<World*>(this)->newest_session();
  return newest ? handle_of<XrSession>(newest->id) : XR_NULL_HANDLE;
}

XrSessionState World::state() const {
  Session* newest = const_cast<World*>(this)->newest_session();
  return newest ? newest->state : XR_SESSION_STATE_UNKNOWN;
}

int64_t World::overlay() const {
  Session* newest = const_cast<World*>(this)->newest_session();
  return newest ? newest->overlay : -1;
}

void World::set_state(Session& session, XrSessionState state) {
  session.state = state;
  XrEventDataSessionStateChanged changed{XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED};
  changed.session = handle_of<XrSession>(session.id);
  changed.state = state;
  changed.time = time;
  XrEventDataBuffer buffer{XR_TYPE_EVENT_DATA_BUFFER};
  std::memcpy(&buffer, &changed, sizeof changed);
  events.push_back(buffer);
}

void World::announce(XrSessionState state) {
  const std::lock_guard lock(mutex);
  if (Session* session = newest_session()) set_state(*session, state);
}

void World::lose_instance() {
  const std::lock_guard lock(mutex);
  XrEventDataInstanceLossPending pending{XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING};
  pending.lossTime = time;
  XrEventDataBuffer buffer{XR_TYPE_EVENT_DATA_BUFFER};
  std::memcpy(&buffer, &pending, sizeof pending);
  events.push_back(buffer);
}

void World::lose_session() {
  const std::lock_guard lock(mutex);
  if (Session* session = newest_session()) session->lost = true;
}

void World::change_rate(double hz) {
  const std::lock_guard lock(mutex);
  if (hz == settings.rate_hz) return;
  XrEventDataDisplayRefreshRateChangedFB changed{
      XR_TYPE_EVENT_DATA_DISPLAY_REFRESH_RATE_CHANGED_FB};
  changed.fromDisplayRefreshRate = float(settings.rate_hz);
  changed.toDisplayRefreshRate = float(hz);
  settings.rate_hz = hz;
  XrEventDataBuffer buffer{XR_TYPE_EVENT_DATA_BUFFER};
  std::memcpy(&buffer, &changed, sizeof changed);
  if (enabled(XR_FB_DISPLAY_REFRESH_RATE_EXTENSION_NAME)) events.push_back(buffer);
}

void World::change_models() {
  const std::lock_guard lock(mutex);
  XrEventDataBuffer buffer{XrStructureType(1000301002)};
  if (enabled("XR_EXT_interaction_render_model")) events.push_back(buffer);
}

void World::recentre(XrReferenceSpaceType space, XrTime at, const XrPosef& pose, bool say_pose) {
  const std::lock_guard lock(mutex);
  const auto tell = [&](XrReferenceSpaceType of, const XrPosef& moved, bool say) {
    XrEventDataReferenceSpaceChangePending pending{
        XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING};
    pending.session = session();
    pending.referenceSpaceType = of;
    pending.changeTime = at;
    pending.poseValid = say;
    pending.poseInPreviousSpace = say ? moved : identity();
    XrEventDataBuffer buffer{XR_TYPE_EVENT_DATA_BUFFER};
    std::memcpy(&buffer, &pending, sizeof pending);
    events.push_back(buffer);
  };
  const XrPosef floor_before = room_from(kLocalFloor, at);
  // This change is relative to the newest of those that are valid at that time.
  changes.push_back({space, at, compose(room_from(space, at), pose)});
  tell(space, pose, say_pose);
  const std::vector<XrReferenceSpaceType> offered = spaces();
  if (std::find(offered.begin(), offered.end(), kLocalFloor) == offered.end()) return;
  // The floor lies below LOCAL. How far it moves is hidden only with LOCAL: of the stage it has the
  // height alone.
  tell(kLocalFloor, compose(inverted(floor_before), room_from(kLocalFloor, at)),
       say_pose || space == XR_REFERENCE_SPACE_TYPE_STAGE);
}

std::vector<XrViewConfigurationType> World::view_types() const {
  if (settings.quad_views && enabled(XR_VARJO_QUAD_VIEWS_EXTENSION_NAME))
    return {XR_VIEW_CONFIGURATION_TYPE_PRIMARY_QUAD_VARJO,
            XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO};
  return {XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO};
}

bool World::follows_gaze() const {
  return settings.foveation && enabled(XR_VARJO_FOVEATED_RENDERING_EXTENSION_NAME);
}

std::vector<XrReferenceSpaceType> World::spaces() const {
  std::vector<XrReferenceSpaceType> offered = settings.spaces;
  if (!enabled("XR_EXT_local_floor")) std::erase(offered, kLocalFloor);
  if (!follows_gaze()) std::erase(offered, XR_REFERENCE_SPACE_TYPE_COMBINED_EYE_VARJO);
  return offered;
}

std::string World::profile_of(int side) const {
  if (hands[side]) return settings.profile;
  const bool seen = settings.sees_hands && fingers[side] && fingers[side](time);
  return seen && enabled("XR_EXT_hand_interaction")
             ? "/interaction_profiles/ext/hand_interaction_ext"
             : "";
}

bool World::enabled(const std::string& extension) const {
  return std::any_of(objects.begin(), objects.end(), [&](const auto& entry) {
    return entry.second->kind == Kind::kInstance &&
           static_cast<const Instance*>(entry.second.get())->extensions.count(extension);
  });
}

XrPosef World::room_from(XrReferenceSpaceType space, XrTime at) const {
  if (space == XR_REFERENCE_SPACE_TYPE_VIEW || space == XR_REFERENCE_SPACE_TYPE_COMBINED_EYE_VARJO)
    return head(at);
  if (space == kLocalFloor) {
    XrPosef floor = room_from(XR_REFERENCE_SPACE_TYPE_LOCAL, at);
    floor.position.y = room_from(XR_REFERENCE_SPACE_TYPE_STAGE, at).position.y;
    return floor;
  }
  XrPosef pose = identity();
  if (space == XR_REFERENCE_SPACE_TYPE_LOCAL) pose.position.y = 1.6F;
  for (const SpaceChange& change : changes)
    if (change.type == space && change.time <= at) pose = change.room_from_new;
  return pose;
}

void World::write_report() const {
  const char* path = std::getenv("PALPATE_FAKE_XR_REPORT");
  if (!path) return;
  std::ofstream file(path);
  file << "frames " << ended_frames << "\nviolations " << wrong.size() << "\n";
  for (const std::string& what : wrong) file << what << "\n";
}

Call::Call(const char* function) : lock_(world().mutex) {
  World& w = world();
  w.remote.listen(w);
  int*& counter = w.counters[function];
  if (!counter) counter = &w.counts[function];
  ++*counter;
  if (w.faults.empty()) return;
  const auto at = w.faults.find(function);
  if (at == w.faults.end()) return;
  for (auto fault = at->second.begin(); fault != at->second.end(); ++fault) {
    if (!fault->always && --fault->nth > 0) continue;
    answer_ = fault->result;
    if (!fault->always) at->second.erase(fault);
    break;
  }
  if (at->second.empty()) w.faults.erase(at);
}

void Call::check_instance(uint64_t id, const char* function) {
  World& w = world();
  instance = w.find<Instance>(Kind::kInstance, id);
  if (!instance) {
    answer_ = w.violation(std::string(function) + ": no such instance", XR_ERROR_HANDLE_INVALID);
    return;
  }
  if (answer_ == XR_ERROR_INSTANCE_LOST) instance->lost = true;
  if (instance->lost) answer_ = XR_ERROR_INSTANCE_LOST;
}

Call::Call(const char* function, XrInstance handle) : Call(function) {
  check_instance(id_of(handle), function);
}

Call::Call(const char* function, XrSession handle) : Call(function) {
  World& w = world();
  session = w.find<Session>(Kind::kSession, id_of(handle));
  if (!session) {
    answer_ = w.violation(std::string(function) + ": no such session", XR_ERROR_HANDLE_INVALID);
    return;
  }
  check_instance(session->parent, function);
  if (answer_ && is_lasting(*answer_) && *answer_ == XR_ERROR_SESSION_LOST) session->lost = true;
  if (!answer_ && session->lost) answer_ = XR_ERROR_SESSION_LOST;
}

XrResult copy_text(const std::string& text, uint32_t capacity, uint32_t* count, char* to) {
  *count = uint32_t(text.size() + 1);
  if (capacity == 0) return XR_SUCCESS;
  if (capacity < *count) return XR_ERROR_SIZE_INSUFFICIENT;
  std::memcpy(to, text.c_str(), text.size() + 1);
  return XR_SUCCESS;
}

XrPosef identity() {
  return {{0, 0, 0, 1}, {0, 0, 0}};
}

namespace {
glm::dquat quat(const XrQuaternionf& q) {
  return glm::normalize(glm::dquat(q.w, q.x, q.y, q.z));
}
glm::dvec3 vec(const XrVector3f& v) {
  return {v.x, v.y, v.z};
}
XrPosef posef(glm::dquat q, glm::dvec3 p) {
  return {{float(q.x), float(q.y), float(q.z), float(q.w)}, {float(p.x), float(p.y), float(p.z)}};
}
}  // namespace

XrPosef compose(const XrPosef& a, const XrPosef& b) {
  const glm::dquat qa = quat(a.orientation);
  return posef(qa * quat(b.orientation), vec(a.position) + qa * vec(b.position));
}

XrPosef inverted(const XrPosef& pose) {
  const glm::dquat back = glm::conjugate(quat(pose.orientation));
  return posef(back, back * -vec(pose.position));
}

bool unit(const XrQuaternionf& q) {
  const double length =
      double(q.x) * q.x + double(q.y) * q.y + double(q.z) * q.z + double(q.w) * q.w;
  // The specification allows an error of 1 % from rounding in applications.
  return std::abs(length - 1.0) < 0.01;
}

}  // namespace palpate::test::fake
