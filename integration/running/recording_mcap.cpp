#include "integration/running/recording_mcap.h"

#include <optional>

#include "integration/files/mcap.h"
#include "module/haptics/servo/recording.h"

namespace palpate::running {
namespace {

// Definitions of ROS 2's messages.
constexpr const char* kRosTime = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec";
constexpr const char* kRosHeader =
    "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id";
constexpr const char* kRosPose =
    "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation";
constexpr const char* kRosPoint = "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z";
constexpr const char* kRosQuaternion =
    "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1";
constexpr const char* kRosWrench =
    "MSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque";
constexpr const char* kRosVector = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z";

/// A message and those that it uses, as ros2msg has them: each after a line of 80 signs.
std::string ros_definition(std::string message, std::initializer_list<const char*> uses) {
  for (const char* one : uses) message += "\n" + std::string(80, '=') + "\n" + one;
  return message;
}

files::CdrMessage stamped(uint64_t time_ns, const char* frame) {
  files::CdrMessage message;
  message.whole(uint32_t(time_ns / 1'000'000'000)).whole(uint32_t(time_ns % 1'000'000'000));
  message.text(frame);
  return message;
}

std::string pose(uint64_t time_ns, const char* frame, glm::dvec3 at_m,
                 glm::dquat rotation = {1.0, 0.0, 0.0, 0.0}) {
  files::CdrMessage message = stamped(time_ns, frame);
  for (const double number :
       {at_m.x, at_m.y, at_m.z, rotation.x, rotation.y, rotation.z, rotation.w})
    message.number(number);
  return message.bytes();
}

std::string wrench(uint64_t time_ns, const char* frame, glm::dvec3 force_n,
                   glm::dvec3 torque_n_m = glm::dvec3(0.0)) {
  files::CdrMessage message = stamped(time_ns, frame);
  for (const double number :
       {force_n.x, force_n.y, force_n.z, torque_n_m.x, torque_n_m.y, torque_n_m.z})
    message.number(number);
  return message.bytes();
}

}  // namespace

Result<uint64_t> write_mcap(const std::filesystem::path& recording,
                            const std::filesystem::path& output) {
  auto read = Recording::read(recording);
  if (!read) return read.error();
  auto file = files::McapWriter::create(output);
  if (!file) return file.error();
  const auto channel = [&](const char* topic, const char* schema, const std::string& text) {
    return file->add_channel(topic, schema, text);
  };
  const std::string of_pose =
      ros_definition("std_msgs/Header header\ngeometry_msgs/Pose pose",
                     {kRosPose, kRosPoint, kRosQuaternion, kRosHeader, kRosTime});
  const std::string of_wrench =
      ros_definition("std_msgs/Header header\ngeometry_msgs/Wrench wrench",
                     {kRosWrench, kRosVector, kRosHeader, kRosTime});
  const uint16_t hand = channel("/palpate/hand", "geometry_msgs/msg/PoseStamped", of_pose);
  const uint16_t probe = channel("/palpate/probe", "geometry_msgs/msg/PoseStamped", of_pose);
  const uint16_t proxy = channel("/palpate/proxy", "geometry_msgs/msg/PoseStamped", of_pose);
  const uint16_t force = channel("/palpate/force", "geometry_msgs/msg/WrenchStamped", of_wrench);
  const uint16_t scene_force =
      channel("/palpate/scene_force", "geometry_msgs/msg/WrenchStamped", of_wrench);
  const uint16_t cause = channel("/palpate/cause", "std_msgs/msg/String", "string data");

  TickInput input;
  TickOutput ticked;
  std::optional<Cause> last;
  while (read->next(input, ticked)) {
    const auto at_ns = uint64_t(input.now_ns);
    const std::pair<uint16_t, std::string> messages[] = {
        {hand,
         pose(at_ns, "device", input.reading.position_m, input.reading.grip.device_from_grip)},
        {probe, pose(at_ns, "world", ticked.probe_m)},
        {proxy, pose(at_ns, "world", ticked.proxy_m)},
        {force, wrench(at_ns, "device", ticked.command.force_n, ticked.command.torque_n_m)},
        {scene_force, wrench(at_ns, "world", ticked.wanted_n)}};
    for (const auto& [to, bytes] : messages)
      if (const Status written = file->write(to, at_ns, bytes); !written) return written.error();
    if (last == ticked.cause) continue;
    last = ticked.cause;
    const std::string word_of_it = files::CdrMessage().text(word(ticked.cause)).bytes();
    if (const Status written = file->write(cause, at_ns, word_of_it); !written)
      return written.error();
  }
  if (const Status written = file->finish(); !written) return written.error();
  return read->ticks();
}

}  // namespace palpate::running
