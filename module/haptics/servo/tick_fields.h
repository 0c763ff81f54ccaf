#pragma once

#include "module/haptics/tick.h"

namespace palpate {

// The fields of a tick, once, for everyone who writes, reads or compares them: the recording, its
// reader, the black box's table. Each calls visit(name, unit, field) in the order of the file; the
// structures may be const or not. A change here is a new version of the recording.

template <class Pose, class Visit>
void visit_pose(Pose& pose, Visit&& visit) {
  visit("pose_volume", "", pose.volume);
  visit("pose_translation", "m", pose.transform.translation_m);
  visit("pose_rotation", "", pose.transform.rotation);
  visit("pose_scale", "", pose.transform.scale);
  visit("pose_time", "ns", pose.time_ns);
}

template <class Event, class Visit>
void visit_event(Event& event, Visit&& visit) {
  visit("event_kind", "", event.kind);
  visit("event_index", "", event.index);
  visit("event_value", "", event.value);
}

/// All but poses, events and the grip.
template <class Input, class Visit>
void visit_input(Input& input, Visit&& visit) {
  visit("dt", "s", input.dt_s);
  visit("now", "ns", input.now_ns);
  visit("position", "m", input.reading.position_m);
  visit("position_time", "ns", input.reading.time_ns);
  visit("buttons", "", input.reading.buttons);
  visit("device_fault", "", input.reading.fault);
  visit("fresh", "", input.reading.fresh);
  visit("late", "", input.late);
  visit("stop", "", input.stop);
}

/// How the grip is held: only what the device senses. Since version 2 of the recording.
template <class Grip, class Visit>
void visit_grip(Grip& grip, Visit&& visit) {
  visit("grip_turns", "", grip.turns);
  visit("grip_opens", "", grip.opens);
  if (grip.turns) {
    visit("grip_rotation", "", grip.device_from_grip);
    visit("grip_angular_velocity", "rad/s", grip.angular_velocity_rad_per_s);
  }
  if (grip.opens) visit("grip_opening", "rad", grip.opening_rad);
}

/// The torque on the grip. Since version 3 of the recording.
template <class Output, class Visit>
void visit_torque(Output& output, Visit&& visit) {
  visit("torque", "N m", output.command.torque_n_m);
}

/// All but the torque.
template <class Output, class Visit>
void visit_output(Output& output, Visit&& visit) {
  visit("force", "N", output.command.force_n);
  visit("in_contact", "", output.command.in_contact);
  visit("wanted", "N", output.wanted_n);
  visit("probe", "m", output.probe_m);
  visit("proxy", "m", output.proxy_m);
  visit("cause", "", output.cause);
  visit("fault", "", output.fault);
  visit("substeps", "", output.substeps);
  visit("primitives", "", output.primitives);
  visit("newton_steps", "", output.newton_steps);
  visit("frozen", "", output.frozen);
  visit("residual", "m", output.residual_m);
  visit("scene_energy", "J", output.scene_energy_j);
  visit("tank", "J", output.tank_j);
  visit("frame", "", output.first.frame);
  visit("phase", "", output.first.phase);
}

}  // namespace palpate
