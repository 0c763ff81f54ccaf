// Candidates of the step for sliding borders: the motion of the cells 1 to kSlidingSteps steps away along each axis, on
// both sides. Four consecutive candidates lie on the same side of the same axis.
ivec3 candidate_offset(int candidate, ivec3 step) {
  ivec3 offset = ivec3(0);
  const int axis = candidate / kSlidingSteps % 3;
  const int side = candidate / (3 * kSlidingSteps);
  offset[axis] = (side == 0 ? 1 : -1) * (candidate % kSlidingSteps + 1) * step[axis];
  return offset;
}

// Whether two motions `offset` cells apart differ as across a sliding border, more than a smooth motion does.
// different.x: least difference in mm; different.y: least difference divided by distance.
bool across_border(vec3 here, vec3 there, ivec3 offset, vec3 cell_mm, vec2 different) {
  return distance(here, there) >= max(different.x, different.y * length(vec3(offset) * cell_mm));
}
