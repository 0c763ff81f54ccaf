// Work on a list of bricks: group (b, s) is slice s of brick b of the list, an invocation is one cell.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;
layout(set = 0, binding = 0) readonly buffer Bricks { uint bricks[]; };  // x | y << 10 | z << 20, in bricks

ivec3 brick_origin() {
  const uint packed_brick = bricks[gl_WorkGroupID.x];
  return kBrick * ivec3(packed_brick & 1023u, packed_brick >> 10 & 1023u, packed_brick >> 20);
}

// The cell of this invocation; may lie beyond the last cell.
ivec3 brick_cell() { return brick_origin() + ivec3(gl_LocalInvocationID.xy, gl_WorkGroupID.y); }

bool beyond(ivec3 cell, ivec3 cells) { return any(greaterThanEqual(cell, cells)); }
