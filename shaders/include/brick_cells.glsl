// Which cells of a brick can show anything, stored in the words of the skip structure (interface/view.h). The including
// shader defines, under these names: the push constants (BrickPush); next_entry, most and skip; the shared array
// values[], kRow and kSlice values from one row and one slice to the next; kBricks, how many bricks are made.
const int kCells = 2 * kBrick;
shared uint cells[kBricks * kCells];
shared uint blocks[kBricks * 4];  // bit per block: any cell shows, two words; every cell shows, two words
shared uint entries[kBricks * 2];  // least and greatest entry in the brick

ivec3 brick_of(uint place) {
  const uvec3 bricks = uvec3(push.bricks.xyz);
  return ivec3(place % bricks.x, place / bricks.x % bricks.y, place / (bricks.x * bricks.y));
}

// A barrier must follow.
void start_cells() {
  const uint lane = gl_LocalInvocationIndex;
  if (lane < uint(kBricks * kCells)) cells[lane] = 0u;
  if (lane < uint(kBricks * 4)) blocks[lane] = 0u;
  if (lane < uint(kBricks * 2)) entries[lane] = (lane & 1u) == 0u ? ~0u : 0u;
}

uint entry(float value, float aside) {
  return uint(clamp(push.table.x * value + push.table.y + aside, 0.0, push.table.w));
}

// Each invocation marks a row of cells of a brick, between its voxels low and high. first: place in values[] of the
// brick's first voxel. over: how far an interpolated value may lie beyond the values at the corners of its cell.
void mark_cells(int brick, int first, ivec3 origin, ivec3 low_voxel, ivec3 high_voxel, float over) {
  const ivec2 yz = ivec2(gl_LocalInvocationIndex % kBrick, gl_LocalInvocationIndex / kBrick);
  const int here = first + kRow * yz.x + kSlice * yz.y;
  const bool inside = all(lessThan(origin.yz + yz, push.size.yz)) &&
                      all(greaterThanEqual(yz, low_voxel.yz)) && all(lessThan(yz, high_voxel.yz));
  uint row_bits = 0u, least = ~0u, greatest = 0u;
  vec2 range = vec2(1e30, -1e30);
  for (int x = 0; x <= kBrick; ++x) {
    const int at = here + x;
    const vec4 face = vec4(values[at], values[at + kRow], values[at + kSlice], values[at + kRow + kSlice]);
    const float low = min(min(face.x, face.y), min(face.z, face.w));
    const float high = max(max(face.x, face.y), max(face.z, face.w));
    // One more entry to each side: rounding may exceed the bounds of the interpolated value.
    const uint from = entry(min(low, range.x) - over, -1.0), to = entry(max(high, range.y) + over, 1.0);
    const bool is_cell = x > low_voxel.x && x <= high_voxel.x && inside && origin.x + x - 1 < push.size.x;
    const bool shows = is_cell && next_entry[uint(push.table.z) + from] <= to;
    row_bits |= (shows ? 1u : 0u) << uint(max(x - 1, 0));
    least = is_cell ? min(least, from) : least;
    greatest = is_cell ? max(greatest, to) : greatest;
    range = vec2(low, high);
  }
  if (inside) {
    atomicOr(cells[kCells * brick + 2 * yz.y + (yz.x >> 2)], row_bits << uint(8 * (yz.x & 3)));
    atomicMin(entries[2 * brick], least);
    atomicMax(entries[2 * brick + 1], greatest);
  }
}

// Cells beyond the volume's last one are never read, so they may leave a block not full.
void mark_blocks(int brick) {
  const int lane = int(gl_LocalInvocationIndex);
  const ivec3 block = ivec3(lane & 3, lane >> 2 & 3, lane >> 4);
  const uint pair = 3u << uint(2 * block.x + 16 * (block.y & 1));
  const uint rows = pair | pair << 8;
  const int word = kCells * brick + 4 * block.z + (block.y >> 1);
  const uint near_cells = cells[word] & rows, far_cells = cells[word + 2] & rows;
  const uint bit = 1u << uint(lane & 31);
  if ((near_cells | far_cells) != 0u) atomicOr(blocks[4 * brick + (lane >> 5)], bit);
  if (near_cells == rows && far_cells == rows) atomicOr(blocks[4 * brick + 2 + (lane >> 5)], bit);
}

// A brick in which something shows here and there also counts as solid if all of it was computed and nothing in it is
// dense: noise about the threshold of a soft look. Samples in its empty cells then cost less than the search for the
// others. Blocks that show anything, of 64; densest extinction, in limits of a thin brick.
const int kHereAndThere = 6;
const float kSoft = 150.0;

// place: of the brick among those of the volume. whole: every cell of it was computed.
void write_cells(int brick, uint place, bool whole) {
  const uint lane = gl_LocalInvocationIndex;
  const int block = 4 * brick;
  const uint word = uint(push.bricks.w) + uint(kSkipWords) * place;
  if (lane < uint(2 * kBrick)) skip[word + uint(kCellWord) + lane] = cells[uint(kCells * brick) + lane];
  if (lane < 4u) skip[word + uint(kBlockWord) + lane] = blocks[uint(block) + lane];
  if (lane == 0u) {
    const uint greatest = entries[2 * brick + 1];
    const uint least = min(entries[2 * brick], greatest);  // 0 for a brick without cells: any entry does
    const uint span = greatest - least + 1u;
    const uint level = uint(findMSB(span));
    const uint table = uint(push.table.z) * uint(kMostLevels) + level * uint(kTable);
    const float densest = max(most[table + least], most[table + greatest + 1u - (1u << level)]);
    const bool soft = whole && densest <= kSoft * push.frames.z &&
                      bitCount(blocks[block]) + bitCount(blocks[block + 1]) >= kHereAndThere;
    const bool full = soft || (blocks[block + 2] & blocks[block + 3]) == 0xffffffffu;
    skip[word] = densest <= push.frames.z && whole ? kThin : full ? kSolid : 0u;
  }
}
