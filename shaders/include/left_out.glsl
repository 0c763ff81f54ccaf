// Whether a cell belongs to a part that is left out of a fit: blocks of 4 x 4 x 4 cells alternate like the fields of a
// chessboard. Cells of smaller blocks share the noise of their neighbours where noise is correlated over many voxels.
bool is_left_out(ivec3 cell, int part) {
  const ivec3 block = cell >> 2;
  return ((block.x + block.y + block.z) & 1) == part;
}
