// Goes through the voxels of a box from `begin` (inside) to `end` (outside), x first, in steps of `stride`, in a loop that
// is tested at its end:
//   ivec3 at = begin;
//   do { ... } while (next_voxel(at, begin, end, 1));
// A CPU driver leaves loops only there: each loop of three that are tested at their start would run through its body once
// more without an invocation that needs it, 27 times for the 8 voxels of a cell. The box must not be empty.
bool next_voxel(inout ivec3 at, ivec3 begin, ivec3 end, int stride) {
  at.x += stride;
  const bool row_ends = at.x >= end.x;
  at.x = row_ends ? begin.x : at.x;
  at.y += row_ends ? stride : 0;
  const bool plane_ends = at.y >= end.y;
  at.y = plane_ends ? begin.y : at.y;
  at.z += plane_ends ? stride : 0;
  return at.z < end.z;
}
