// Draws a moving volume with WebGL 2 as the renderer of palpate does: each change of phase back-tracks nodes through the motion (equation (26),
// y + u(y) = x) and reads the values of the frame there into a volume with slopes; rays then read that volume (raycast.comp).
// All textures of half floats are drawn into layer by layer.
'use strict';

const kNode = 4;     // voxels between back-tracked nodes
const kBrick = 8;    // cells along the edge of a brick that may be skipped
const kTable = 2048; // entries of the look
const kMostThings = 40;

// Vectors and matrices are arrays; a matrix has 16 numbers, columns first, as WebGL takes them.
export const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
export const scale = (a, s) => [s * a[0], s * a[1], s * a[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.sqrt(dot(a, a));
export const unit = (a) => scale(a, 1 / Math.max(length(a), 1e-12));
export const point = (m, p) => [0, 1, 2].map((r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]);
export const direction = (m, p) => [0, 1, 2].map((r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2]);

/** a after b. */
export function multiplied(a, b) {
  const m = new Array(16);
  for (let c = 0; c < 4; ++c)
    for (let r = 0; r < 4; ++r) {
      let sum = 0;
      for (let k = 0; k < 4; ++k) sum += a[4 * k + r] * b[4 * c + k];
      m[4 * c + r] = sum;
    }
  return m;
}

/** The inverse of an affine map. */
export function inverse(m) {
  const x = m.slice(0, 3), y = m.slice(4, 7), z = m.slice(8, 11), t = m.slice(12, 15);
  const yz = cross(y, z), zx = cross(z, x), xy = cross(x, y), det = dot(x, yz);
  const rows = [scale(yz, 1 / det), scale(zx, 1 / det), scale(xy, 1 / det)];
  return [rows[0][0], rows[1][0], rows[2][0], 0, rows[0][1], rows[1][1], rows[2][1], 0,
    rows[0][2], rows[1][2], rows[2][2], 0, -dot(rows[0], t), -dot(rows[1], t), -dot(rows[2], t), 1];
}

/** The frame pointer at a time: frame, and share of the way to the next one. As pointer_at() of module/scene/playback.h. */
export function pointerAt(scene, time_s) {
  const times = scene.times_s, last = times.length - 1, cycle = scene.cycle_s;
  if (!(time_s > 0) && !(cycle > 0)) return {frame: 0, phase: 0};
  const t = cycle > 0 ? ((time_s % cycle) + cycle) % cycle : Math.min(time_s, times[last]);
  let frame = 0;
  while (frame < last && times[frame + 1] <= t) ++frame;
  const end = frame < last ? times[frame + 1] : cycle;
  return {frame, phase: end > times[frame] ? Math.max(0, Math.min((t - times[frame]) / (end - times[frame]), 1)) : 0};
}

/** An eye at `from` that looks at `to`, y upwards: position, axes (right, up, back) and the tangents of its angles of view. */
export function eyeAt(from, to, heightAngle, aspect) {
  const back = unit(add(from, to, -1)), right = unit(cross([0, 1, 0], back)), up = cross(back, right);
  const tan = Math.tan(heightAngle / 2);
  return {from, right, up, back, tan: [-tan * aspect, tan * aspect, -tan, tan]};
}

/** The eye of `palpate view`: in front of a box, a little to the right and above, all of it just visible. */
export function eyeBefore(corners, aspect, heightAngle = 0.55) {
  const ends = [0, 1, 2].map((a) => corners.map((corner) => corner[a]));
  const centre = ends.map((along) => 0.5 * (Math.min(...along) + Math.max(...along)));
  const way = unit([0.42, 0.30, 1.0]);
  const eye = eyeAt(add(centre, way), centre, heightAngle, aspect);
  let distance = 1e-6;
  for (const place of corners) {
    const corner = add(place, centre, -1);
    const x = Math.abs(dot(corner, eye.right)) / (0.93 * eye.tan[1]), y = Math.abs(dot(corner, eye.up)) / (0.93 * eye.tan[3]);
    distance = Math.max(distance, Math.max(x, y) + dot(corner, eye.back));
  }
  return {centre, distance, way};
}

const kVertex = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

// A layer of the nodes: y - x in voxels where y + u(y) = x, by fixed-point iteration; a step that does not help is halved.
const kNodes = `#version 300 es
precision highp float;
precision highp sampler3D;
uniform sampler3D fieldA, fieldB;
uniform vec2 weights;
uniform mat4 fromVoxel;
uniform vec3 fieldSize;
uniform float layer;
out vec4 back;
vec3 u(vec3 y) {
  vec3 at = ((fromVoxel * vec4(y, 1.0)).xyz + 0.5) / fieldSize;
  return weights.x * textureLod(fieldA, at, 0.0).xyz + weights.y * textureLod(fieldB, at, 0.0).xyz;
}
void main() {
  vec3 x = ${kNode}.0 * vec3(gl_FragCoord.xy - 0.5, layer), best = x, way = vec3(0.0), at = x;
  float bestMiss = 1e30;
  for (int round = 0; round < 24 && bestMiss > 1e-3; ++round) {
    vec3 off = at + u(at) - x;
    float miss = length(off);
    if (miss < bestMiss) { bestMiss = miss; best = at; way = -off; } else way *= 0.5;
    at = best + way;
  }
  back = vec4(best - x, 1.0);
}`;

// A layer of the values at their phase, equations (23) to (25) as in brick.comp.
const kCarry = `#version 300 es
precision highp float;
precision highp sampler3D;
uniform sampler3D nodes, frame, next;
uniform vec3 size, nodeSize;
uniform vec4 how; // weights of both frames, 1 where nodes are read, 1 / phase
uniform float layer;
out float value;
void main() {
  vec3 voxel = vec3(gl_FragCoord.xy - 0.5, layer);
  vec3 back = how.z > 0.0 ? textureLod(nodes, (voxel / ${kNode}.0 + 0.5) / nodeSize, 0.0).xyz : vec3(0.0);
  vec3 y = voxel + back + 0.5;
  value = how.x * textureLod(frame, y / size, 0.0).x;
  if (how.y > 0.0) value += how.y * textureLod(next, (y - how.w * back) / size, 0.0).x;
}`;

// A layer of what rays read: slope (shares per mm), by central differences, and value.
const kSlopes = `#version 300 es
precision highp float;
precision highp sampler3D;
uniform sampler3D values;
uniform vec3 perMm;
uniform float layer;
out vec4 surface;
float value(ivec3 at, ivec3 last) { return texelFetch(values, clamp(at, ivec3(0), last), 0).x; }
void main() {
  ivec3 x = ivec3(gl_FragCoord.xy, layer), last = textureSize(values, 0) - 1;
  vec3 slope = vec3(value(x + ivec3(1, 0, 0), last) - value(x - ivec3(1, 0, 0), last),
    value(x + ivec3(0, 1, 0), last) - value(x - ivec3(0, 1, 0), last), value(x + ivec3(0, 0, 1), last) - value(x - ivec3(0, 0, 1), last));
  surface = vec4(0.5 * perMm * slope, value(x, last));
}`;

// A layer of bricks of 8 x 8 x 8 cells: 1 where some value in the brick has extinction.
const kBricks = `#version 300 es
precision highp float;
precision highp sampler3D;
uniform sampler3D volume;
uniform sampler2D look;
uniform vec3 size;
uniform vec4 table;
uniform float layer;
out vec4 shows;
void main() {
  ivec3 first = ${kBrick} * ivec3(gl_FragCoord.xy, layer), last = min(first + ${kBrick}, ivec3(size) - 1);
  float low = 1e30, high = -1e30;
  for (int z = first.z; z <= last.z; ++z)
    for (int y = first.y; y <= last.y; ++y)
      for (int x = first.x; x <= last.x; ++x) {
        float value = texelFetch(volume, ivec3(x, y, z), 0).w;
        low = min(low, value);
        high = max(high, value);
      }
  vec2 entry = clamp(table.x * vec2(low, high) + table.y, 0.5, ${kTable}.0 - 0.5);
  float next = texelFetch(look, ivec2(max(int(entry.x - 0.5), 0), 2), 0).x;
  shows = vec4(next <= entry.y + 0.5 ? 1.0 : 0.0);
}`;

// Rays. The same sums as in raycast.comp, for one volume; things are round cones, opaque.
const kRays = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler3D;
uniform sampler3D volume, bricks;
uniform sampler2D look;
uniform vec4 viewport;                            // x, y, width, height
uniform vec3 origin, first, right, down;          // of rays, world
uniform vec3 vOrigin, vFirst, vRight, vDown;      // the same in voxels
uniform vec3 size, spacing, light, worldLight, stretch, top, bottom;
uniform vec4 table, shine;
uniform float near;
uniform int things, probing;
uniform vec4 thing[${3 * kMostThings}];           // from and radius, to and radius, colour
layout(location = 0) out vec4 colourOut;
const float kStop = 1.0 / 256.0, kFar = 1e30;
const float kSeen = 0.9; // of the light is left where a pointer touches: also thin walls are met

vec3 encoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
}
vec3 decoded(vec3 c) {
  return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045)));
}

vec3 start, way;
vec4 sampled(float t) {
  vec4 read = textureLod(volume, (start + t * way + 0.5) / size, 0.0);
  return vec4(read.xyz, clamp(table.x * read.w + table.y, 0.5, ${kTable}.0 - 0.5));
}
vec4 integral(float entry) {
  vec4 low = texelFetch(look, ivec2(int(entry - 0.5), 1), 0);
  return mix(low, texelFetch(look, ivec2(min(int(entry + 0.5), ${kTable} - 1), 1), 0), fract(entry - 0.5));
}
vec3 towardsEye, halfway;
vec4 lit(vec4 one, vec4 other) {
  float between = other.w - one.w;
  vec4 here = texelFetch(look, ivec2(int(0.5 * (one.w + other.w)), 0), 0);
  vec4 glow = abs(between) < 1.0 ? vec4(here.rgb * here.w, here.w) : max((integral(other.w) - integral(one.w)) / between, vec4(0.0));
  if (glow.w <= 0.0) return vec4(0.0);
  vec3 slope = (one.xyz + other.xyz) * stretch;
  float square = dot(slope, slope), surface = min(0.25 * square * table.w, 1.0);
  vec3 normal = slope * inversesqrt(max(square, 1e-20));
  float side = dot(normal, towardsEye) > 0.0 ? 1.0 : -1.0;
  float diffuse = max(0.3 + 0.7 * side * dot(normal, light), 0.0);
  float shines = pow(max(side * dot(normal, halfway), 0.0), 32.0);
  float how = mix(1.0, shine.x + shine.y * diffuse, surface), kept = 1.0 - (1.0 - shine.w) * (1.0 - surface);
  return kept * vec4(glow.rgb * how + glow.w * shine.z * shines * surface, glow.w);
}

// The hull of two spheres is the union of all spheres between them, centre a + s d, radius r + s k. A ray meets its side where
// the least of |p - a - s d|^2 - (r + s k)^2 over s is zero; that is at s = B / A. Returns t, or kFar.
float meets(vec3 o, vec3 v, vec4 from, vec4 to, out vec3 normal) {
  vec3 d = to.xyz - from.xyz, q = o - from.xyz;
  float k = to.w - from.w, A = dot(d, d) - k * k, best = kFar, vv = dot(v, v);
  for (int end = 0; end < 2; ++end) {
    vec3 c = end == 0 ? q : o - to.xyz;
    float radius = end == 0 ? from.w : to.w, b = dot(c, v), h = b * b - vv * (dot(c, c) - radius * radius);
    if (h < 0.0) continue;
    float t = (-b - sqrt(h)) / vv;
    if (t > near && t < best) { best = t; normal = (c + t * v) / radius; }
  }
  if (A <= 1e-12) return best;
  float b0 = dot(q, d) + from.w * k, b1 = dot(v, d);
  float a2 = b1 * b1 - A * vv, a1 = b0 * b1 - A * dot(q, v), a0 = b0 * b0 - A * (dot(q, q) - from.w * from.w), h = a1 * a1 - a2 * a0;
  if (h < 0.0 || a2 >= 0.0) return best;
  float t = (-a1 + sqrt(h)) / a2, s = (b0 + t * b1) / A;
  if (s > 0.0 && s < 1.0 && t > near && t < best) {
    best = t;
    normal = (q + t * v - s * d) / (from.w + s * k);
  }
  return best;
}

void main() {
  vec2 pixel = vec2(gl_FragCoord.x - viewport.x, viewport.w - (gl_FragCoord.y - viewport.y)) - 0.5;
  vec3 seen = first + pixel.x * right + pixel.y * down;
  start = vOrigin;
  way = vFirst + pixel.x * vRight + pixel.y * vDown;
  way = mix(way, vec3(1e-12), lessThan(abs(way), vec3(1e-12)));

  // The nearest thing.
  float thingAt = kFar;
  vec3 thingColour = vec3(0.0), normal = vec3(0.0);
  for (int n = 0; n < things; ++n) {
    vec3 outward;
    float t = meets(origin, seen, thing[3 * n], thing[3 * n + 1], outward);
    if (t >= thingAt) continue;
    thingAt = t;
    vec3 eye = -normalize(seen);
    float diffuse = max(0.35 + 0.65 * dot(outward, worldLight), 0.0), facing = max(dot(outward, eye), 0.0);
    float shines = pow(max(dot(outward, normalize(worldLight + eye)), 0.0), 32.0);
    thingColour = thing[3 * n + 2].rgb * (0.30 + 0.55 * diffuse + 0.25 * facing) + 0.22 * shines;
  }

  vec3 a = (-0.5 - start) / way, b = (size - 0.5 - start) / way, low = min(a, b), high = max(a, b);
  float from = max(max(max(low.x, low.y), low.z), near), to = min(min(min(high.x, high.y), high.z), thingAt);
  vec3 mm = way * spacing;
  float mmPerT = length(mm), dt = min(spacing.x, min(spacing.y, spacing.z)) / mmPerT;
  towardsEye = -mm / mmPerT;
  halfway = normalize(towardsEye + light);
  float jitter = fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
  vec3 colour = vec3(0.0);
  float through = 1.0, depth = kFar;
  if (from < to) {
    float k = floor(from / dt - jitter), lower = from;
    vec4 before;
    bool fresh = false; // before is the sample at lower
    for (int n = 0; n < 8192 && lower < to && through > kStop; ++n) {
      // To the last sample before the end of a brick that shows nothing.
      ivec3 brick = clamp(ivec3(start + lower * way), ivec3(0), ivec3(size) - 1) / ${kBrick};
      if (texelFetch(bricks, brick, 0).x == 0.0) {
        vec3 exits = (${kBrick}.0 * (vec3(brick) + vec3(greaterThan(way, vec3(0.0)))) - start) / way;
        float end = floor(min(min(exits.x, exits.y), min(exits.z, to)) / dt - jitter);
        if (end > k) {
          k = end;
          lower = (k + jitter) * dt;
          fresh = false;
          continue;
        }
      }
      if (!fresh) before = sampled(lower);
      fresh = true;
      k += 1.0;
      float upper = min((k + jitter) * dt, to);
      vec4 after = sampled(upper), found = lit(before, after) * mmPerT;
      float passes = exp(-found.w * (upper - lower)), was = through;
      colour += through * (1.0 - passes) / max(found.w, 1e-20) * found.rgb;
      through *= passes;
      if (was > kSeen && through <= kSeen) depth = lower + log(was / kSeen) / max(found.w, 1e-20);
      before = after;
      lower = upper;
    }
  }
  if (probing == 1) {
    colourOut = vec4(depth < kFar ? depth : -1.0, 0.0, 0.0, 1.0);
    return;
  }
  if (through <= kStop) {
    colour /= 1.0 - through;
    through = 0.0;
  }
  float height = (pixel.y + 0.5) / viewport.w;
  colour += through * (thingAt < kFar ? thingColour : mix(top, bottom, height));
  colourOut = vec4(encoded(colour), 1.0);
}`;

/** Draws one scene; made again if WebGL's context was lost. */
export class VolumeView {
  /** Throws a sentence if this browser can not draw volumes. */
  constructor(canvas) {
    const gl = canvas.getContext('webgl2', {alpha: false, antialias: false, depth: false, powerPreference: 'high-performance',
      preserveDrawingBuffer: true, xrCompatible: true});
    if (!gl) throw new Error('This browser has no WebGL 2, which draws the volume: use another one.');
    this.full = gl.getExtension('EXT_color_buffer_float') !== null;
    if (!this.full && !gl.getExtension('EXT_color_buffer_half_float'))
      throw new Error('This browser\'s WebGL can not draw into half floats: use another one, or another graphics driver.');
    this.gl = gl;
    this.programs = {nodes: this.program(kNodes), carry: this.program(kCarry), slopes: this.program(kSlopes), bricks: this.program(kBricks), rays: this.program(kRays)};
    this.framebuffer = gl.createFramebuffer();
    this.none = gl.createVertexArray();
    this.still = this.volumeTexture([1, 1, 1], gl.RGB16F, gl.RGB, new Uint16Array(3));
    this.parts = new Map(); // textures by their number
    this.scene = null;
    this.shown = '';
  }

  program(fragment) {
    const gl = this.gl, made = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, kVertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost())
        throw new Error(`This browser refuses a shader of the page: ${gl.getShaderInfoLog(shader)}`);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(`This browser refuses a shader of the page: ${gl.getProgramInfoLog(made)}`);
    const places = {};
    for (let n = 0; n < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); ++n) {
      const name = gl.getActiveUniform(made, n).name.replace('[0]', '');
      places[name] = gl.getUniformLocation(made, name);
    }
    return {made, places};
  }

  volumeTexture(size, format, channels, data, type = this.gl.HALF_FLOAT, filter = this.gl.LINEAR) {
    const gl = this.gl, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_3D, texture);
    for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(gl.TEXTURE_3D, axis, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MAG_FILTER, filter);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage3D(gl.TEXTURE_3D, 0, format, ...size, 0, channels, type, data);
    return texture;
  }

  /** Takes a scene; fetchPart(number) gives the bytes of a part. Parts that are here already are kept. */
  async setScene(scene, fetchPart) {
    const gl = this.gl, wanted = new Map();
    for (const number of scene.frames) wanted.set(number, (bytes) => this.volumeTexture(scene.size, gl.R16F, gl.RED, new Uint16Array(bytes)));
    for (const number of scene.motion?.parts ?? [])
      if (number !== null)
        wanted.set(number, (bytes) => this.volumeTexture(scene.motion.size, gl.RGB16F, gl.RGB, new Uint16Array(bytes)));
    wanted.set(scene.look, (bytes) => {
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, kTable, 3, 0, gl.RGBA, gl.FLOAT, new Float32Array(bytes));
      return texture;
    });
    const missing = [...wanted.keys()].filter((number) => !this.parts.has(number));
    const got = await Promise.all(missing.map((number) => fetchPart(number)));
    missing.forEach((number, n) => this.parts.set(number, wanted.get(number)(got[n])));
    for (const [number, texture] of this.parts)
      if (!wanted.has(number)) {
        gl.deleteTexture(texture);
        this.parts.delete(number);
      }
    const nodes = scene.size.map((n) => Math.floor((n - 1) / kNode) + 2);
    if (!this.scene || this.scene.size.join() !== scene.size.join()) {
      gl.deleteTexture(this.surface ?? null);
      gl.deleteTexture(this.nodes ?? null);
      gl.deleteTexture(this.values ?? null);
      gl.deleteTexture(this.bricks ?? null);
      this.bricks = this.volumeTexture(scene.size.map((n) => Math.ceil(n / kBrick)), gl.R8, gl.RED, null, gl.UNSIGNED_BYTE);
      this.surface = this.volumeTexture(scene.size, gl.RGBA16F, gl.RGBA, null);
      this.values = this.volumeTexture(scene.size, this.full ? gl.R32F : gl.R16F, gl.RED, null, this.full ? gl.FLOAT : gl.HALF_FLOAT, gl.NEAREST);
      this.nodes = this.volumeTexture(nodes, gl.RGBA16F, gl.RGBA, null);
    }
    this.nodeSize = nodes;
    this.scene = scene;
    this.shown = '';
  }

  use(program) {
    this.gl.useProgram(program.made);
    this.gl.bindVertexArray(this.none);
    this.unit = 0;
    return program.places;
  }
  bind(place, texture, target = this.gl.TEXTURE_3D) {
    this.gl.activeTexture(this.gl.TEXTURE0 + this.unit);
    this.gl.bindTexture(target, texture);
    this.gl.uniform1i(place, this.unit++);
  }
  drawLayers(texture, size, layerPlace) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.viewport(0, 0, size[0], size[1]);
    for (let layer = 0; layer < size[2]; ++layer) {
      gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, texture, 0, layer);
      gl.uniform1f(layerPlace, layer);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
  }

  /** Brings the volume to a time of its sequence. */
  bringTo(time_s) {
    const gl = this.gl, scene = this.scene, {frame, phase} = pointerAt(scene, time_s);
    // Two fields with weights, the frames with theirs.
    const motion = scene.motion;
    let fields = [null, null], weights = [1, 0], frames = [0, 0], shares = [1, 0], perPhase = 0;
    if (scene.whole) {
      const halves = 2 * (frame + phase), low = Math.floor(halves), count = motion.parts.length;
      const wrap = (n) => (scene.cycle_s > 0 ? n % count : Math.min(n, count - 2));
      fields = [motion.parts[wrap(low)], motion.parts[wrap(low + 1)]];
      weights = [1 - (halves - low), halves - low];
    } else {
      const next = frame + 1 < scene.frames.length ? frame + 1 : scene.cycle_s > 0 ? 0 : frame;
      frames = [frame, next];
      shares = scene.blends && phase > 0 ? [1 - phase, phase] : [1, 0];
      if (phase > 0 && motion) fields = [motion.parts[frame] ?? null, null];
      weights = [phase, 0];
      perPhase = fields[0] !== null && phase > 0 ? 1 / phase : 0;
    }
    const moves = fields[0] !== null;
    const shown = [frames, shares, fields, weights].join();
    if (shown === this.shown) return;
    this.shown = shown;
    gl.disable(gl.SCISSOR_TEST);
    if (moves) {
      const to = this.use(this.programs.nodes);
      this.bind(to.fieldA, this.parts.get(fields[0]));
      this.bind(to.fieldB, fields[1] !== null ? this.parts.get(fields[1]) : this.still);
      gl.uniform2fv(to.weights, weights);
      gl.uniformMatrix4fv(to.fromVoxel, false, motion.from_voxel);
      gl.uniform3fv(to.fieldSize, motion.size);
      this.drawLayers(this.nodes, this.nodeSize, to.layer);
    }
    const to = this.use(this.programs.carry);
    this.bind(to.nodes, moves ? this.nodes : this.still);
    this.bind(to.frame, this.parts.get(scene.frames[frames[0]]));
    this.bind(to.next, this.parts.get(scene.frames[frames[1]]));
    gl.uniform3fv(to.size, scene.size);
    gl.uniform3fv(to.nodeSize, this.nodeSize);
    gl.uniform4f(to.how, shares[0], shares[1], moves ? 1 : 0, perPhase);
    this.drawLayers(this.values, scene.size, to.layer);
    const slopes = this.use(this.programs.slopes);
    this.bind(slopes.values, this.values);
    gl.uniform3fv(slopes.perMm, scene.spacing_mm.map((s) => 1 / s));
    this.drawLayers(this.surface, scene.size, slopes.layer);
    const bricks = this.use(this.programs.bricks);
    this.bind(bricks.volume, this.surface);
    this.bind(bricks.look, this.parts.get(scene.look), gl.TEXTURE_2D);
    gl.uniform3fv(bricks.size, scene.size);
    gl.uniform4fv(bricks.table, scene.table);
    this.drawLayers(this.bricks, scene.size.map((n) => Math.ceil(n / kBrick)), bricks.layer);
  }

  /**
   * Draws the volume for an eye. place: world_from_volume; target: a framebuffer (null: the canvas) and its viewport.
   * things: lists of {from, to, radius, toRadius, colour (sRGB)}. lightAxes: the eye whose axes the light has.
   */
  draw(eye, place, things, target, viewport, lightEye = eye, probing = false) {
    const gl = this.gl, scene = this.scene, to = this.use(this.programs.rays);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(...viewport);
    const [l, r, d, u] = eye.tan, right = (r - l) / viewport[2], down = (u - d) / viewport[3];
    const along = (x, y, z) => add(add(scale(eye.right, x), eye.up, y), eye.back, z);
    const rays = [along(l + 0.5 * right, u - 0.5 * down, -1), along(right, 0, 0), along(0, -down, 0)];
    const voxelFromWorld = multiplied(scene.voxel_from_volume, inverse(place));
    const light = unit(add(add(scale(lightEye.right, scene.light[0]), lightEye.up, scene.light[1]), lightEye.back, scene.light[2]));
    // Along the axes of the voxels, which are at right angles.
    const inVoxels = (way) => unit(direction(voxelFromWorld, way).map((x, a) => x * scene.spacing_mm[a]));
    this.bind(to.volume, this.surface);
    this.bind(to.bricks, this.bricks);
    this.bind(to.look, this.parts.get(scene.look), gl.TEXTURE_2D);
    gl.uniform4fv(to.viewport, viewport);
    gl.uniform3fv(to.origin, eye.from);
    gl.uniform3fv(to.vOrigin, point(voxelFromWorld, eye.from));
    ['first', 'right', 'down'].forEach((name, n) => {
      gl.uniform3fv(to[name], rays[n]);
      gl.uniform3fv(to[`v${name[0].toUpperCase()}${name.slice(1)}`], direction(voxelFromWorld, rays[n]));
    });
    gl.uniform3fv(to.size, scene.size);
    gl.uniform3fv(to.spacing, scene.spacing_mm);
    gl.uniform3fv(to.light, inVoxels(light));
    gl.uniform3fv(to.worldLight, light);
    gl.uniform3fv(to.stretch, scene.stretch.slice(0, 3));
    gl.uniform4fv(to.table, scene.table);
    gl.uniform4fv(to.shine, scene.shine);
    gl.uniform3fv(to.top, scene.background[0].map(linear));
    gl.uniform3fv(to.bottom, scene.background[1].map(linear));
    gl.uniform1f(to.near, 0.02);
    const shown = things.slice(0, kMostThings), numbers = new Float32Array(12 * Math.max(1, shown.length));
    shown.forEach((thing, n) => numbers.set([...thing.from, thing.radius, ...thing.to, thing.toRadius, ...thing.colour.map(linear), 1], 12 * n));
    gl.uniform1i(to.things, shown.length);
    gl.uniform4fv(to.thing, numbers);
    gl.uniform1i(to.probing, probing ? 1 : 0);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** The depth along the eye's axis (m) at which a tenth of the light of one pixel is gone; null: nothing is there. */
  depthAt(eye, place, x, y) {
    const gl = this.gl;
    if (!this.probe) {
      this.probe = {texture: gl.createTexture(), framebuffer: gl.createFramebuffer()};
      gl.bindTexture(gl.TEXTURE_2D, this.probe.texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, this.full ? gl.RGBA32F : gl.RGBA16F, 1, 1);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.probe.framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.probe.texture, 0);
    }
    const [l, r, d, u] = eye.tan, tx = l + x * (r - l), ty = u - y * (u - d), e = 1e-4;
    this.draw({...eye, tan: [tx - e, tx + e, ty - e, ty + e]}, place, [], this.probe.framebuffer, [0, 0, 1, 1], eye, true);
    const read = new Float32Array(4);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, read);
    return read[0] > 0 ? read[0] : null;
  }
}

function linear(c) {
  return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
}
