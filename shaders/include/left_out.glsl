// Whether a cell belongs to a part that is left out of a fit: blocks of 2 x 2 x 2 cells alternate like the fields of a
// chessboard. A single cell would share the noise of its neighbours where noise is correlated over voxels.
bool is_left_out(ivec3 cell, int part) {
  const ivec3 block = cell >> 1;
  return ((block.x + block.y + block.z) & 1) == part;
}
