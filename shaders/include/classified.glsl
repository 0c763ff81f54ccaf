// How values of a volume become colour and extinction, and where its skip words are. The including shader defines, under these names: the parameters
// (view), the texels of look tables (tables) and of skip words (skips), the buffer of the skip words (skip_buffer) and
// kTexels, see raycast.comp.
vec4 table(uint i) { return texelFetch(tables, int(i)); }
uint skip(uint i) { return kTexels != 0 ? texelFetch(skips, int(i)).x : skip_buffer[i]; }

// The first skip word of a brick.
uint skip_word(int v, ivec3 brick) {
  const ivec4 bricks = view.volumes[v].bricks;
  return uint(bricks.w + kSkipWords * (brick.x + bricks.x * (brick.y + bricks.y * brick.z)));
}

// What was read at a voxel: its slope, and its value as an entry of the table.
vec4 classified(int v, vec4 read, vec3 voxel) {
  const vec3 size = view.volumes[v].size.xyz;
  // Values of a carried volume are read with their slopes, see curve.comp.
  const vec3 place = view.volumes[v].stretch.w * (clamp(voxel, vec3(0.0), size - 1.0) - 0.5 * (size - 1.0));
  const float value = read.w + dot(read.xyz, place * view.volumes[v].spacing_mm.xyz);
  const vec4 scale = view.volumes[v].table;
  return vec4(read.xyz, clamp(scale.x * value + scale.y, 0.5, float(kTable) - 0.5));
}

// The integrals of extinction times colour, and of extinction, up to an entry.
vec4 integral(int v, float entry) {
  const uint first = uint(view.volumes[v].table.z) * 2u + uint(kTable);
  return mix(table(first + uint(entry - 0.5)), table(first + min(uint(entry + 0.5), uint(kTable - 1))), fract(entry - 0.5));
}

// Colour times extinction, and extinction, of an entry.
vec4 glow_of(int v, float entry) {
  const vec4 here = table(uint(view.volumes[v].table.z) * 2u + uint(entry));
  return vec4(here.rgb * here.w, here.w);
}

// Their means over all values between two entries, whose integrals are these; `near` where these differ by less than
// one, which should be that of an entry there.
vec4 mean_between(float one, float other, vec4 up_to_one, vec4 up_to_other, vec4 near) {
  const float between = other - one;
  const vec4 mean = (up_to_other - up_to_one) / between;
  return abs(between) < 1.0 ? near : max(mean, vec4(0.0));
}

// How much of a surface there is where the squared slope has this value: 0 in flat tissue, 1 from the look's slope of a
// full surface on.
float surface_of(int v, float square) { return min(square * view.volumes[v].table.w, 1.0); }

// The share of the extinction that stays: exactly 1 where the opacity depends on the value alone.
float kept_of(int v, float surface) { return 1.0 - (1.0 - view.volumes[v].shine.w) * (1.0 - surface); }
