// The live page: it takes the scene and its states from palpate, draws the volume (live_view.js), and is a hand where the session has none of
// its own: a pointer, a finger, or in a headset a controller. State comes by WebSocket; poses go back.
import {VolumeView, add, dot, eyeAt, eyeBefore, length, point, pointerAt, scale} from './live_view.js';

const find = (id) => document.getElementById(id);
const canvas = find('picture');
const kHeightAngle = 0.55, kSteepest = 1.5;           // radians
const kMostForce = 4;                                 // N, of a full bar
const kApproach_s = 0.25;                             // from in front of the surface to where the hand is put
const kGate_ms = 700;                                 // so long it waits at most in front
const kPushPerNotch = 1 / 40;                         // of the ball around the volume
const kSlow_ms = 40, kQuick_ms = 20, kLeastScale = 0.2;

let view = null, scene = null, state = null, heardAt = 0, me = 0, socket = null;
let camera = null;       // {centre, distance, azimuth, elevation}
let resolution = 1, lastDrawn = 0, fixed = location.hash === '#fixed';

// What comes from palpate.

function say(text) { if (find('note').textContent !== text) find('note').textContent = text; }

function connect() {
  const address = new URL('state', location.href);
  address.protocol = 'wss:';
  socket = new WebSocket(address);
  socket.onmessage = (event) => take(JSON.parse(event.data));
  socket.onclose = (event) => {
    letGo();
    state = null;
    say(event.reason ? `palpate has closed the connection: ${event.reason}. Load the page again.`
      : 'There is no connection to palpate; trying again.');
    if (!event.reason) setTimeout(connect, 1000);
  };
}

function send(message) { if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message)); }

let fetching = false;
function take(message) {
  if (message.you) { me = message.you; return; }
  state = message;
  // After a pause palpate lets go; a hand that is still there comes from in front again, where the start gate opens.
  if (hand?.held && state.holder !== me) hand = {...hand, since: null, begun: performance.now()};
  if (hand) hand.held = state.holder === me;
  heardAt = performance.now();
  if (message.scene > 0 && message.scene !== scene?.generation && !fetching) load();
  showState();
}

async function load() {
  fetching = true;
  try {
    const got = await (await fetch('scene')).json();
    if (got === null) { say('There is no volume to draw.'); return; }
    view ??= new VolumeView(canvas);
    await view.setScene(got, async (number) => {
      const reply = await fetch(`part/${number}`);
      if (!reply.ok) throw new Error('replaced');
      return reply.arrayBuffer();
    });
    const isFirst = scene === null;
    scene = got;
    if (isFirst) arrange();
  } catch (error) {
    // A part that was replaced meanwhile: the next state names the newer scene.
    if (error.message !== 'replaced') say(error.message);
    if (view === null) scene = null;
  } finally {
    fetching = false;
  }
}

/** The first look at a scene. */
function arrange() {
  document.title = `palpate: ${scene.title}`;
  find('title').textContent = scene.title;
  const first = eyeBefore(scene.corners_m, canvas.clientWidth / Math.max(1, canvas.clientHeight), kHeightAngle);
  camera = {centre: first.centre, distance: first.distance, azimuth: Math.atan2(first.way[0], first.way[2]), elevation: Math.asin(first.way[1])};
  for (const id of ['depth-label', 'sound', 'force']) find(id).hidden = !scene.can_touch;
  for (const row of document.querySelectorAll('.touching')) row.hidden = !scene.can_touch;
  find('time-label').hidden = scene.times_s.length < 2;
  if (scene.patient)
    for (let n = 0; n < 6; ++n) find('letters').append(document.createElement('span'));
  fetch('address.svg').then(async (reply) => {
    if (!reply.ok) return;
    const drawn = new DOMParser().parseFromString(await reply.text(), 'image/svg+xml').documentElement;
    find('qr').replaceChildren(document.adoptNode(drawn));
  });
  offerHeadset();
}

/** The radius of a sphere around the volumes, as the renderer's bounds(). */
function ball() {
  const middle = scale(add(scene.low_m, scene.high_m), 0.5);
  return Math.max(...scene.corners_m.map((corner) => length(add(corner, middle, -1))));
}

function timeNow() {
  if (!state || state.time_s === undefined) return 0;
  return state.time_s + state.rate * Math.min(0.2, (performance.now() - heardAt) / 1000);
}

function showState() {
  const force = length(state.force_n), touches = state.touches && state.holder !== 0;
  find('level').style.width = `${Math.min(100, 100 * force / kMostForce)}%`;
  find('newtons').textContent = `${force.toFixed(2)} N`;
  find('cause').textContent = state.holder !== 0 ? state.cause ?? '' : '';
  find('play').disabled = !state.can_play;
  find('play').textContent = state.rate === 0 ? 'Play' : 'Pause';
  if (scene) say(state.holder !== 0 && state.holder !== me ? 'Someone else is touching.' : state.note ?? '');
  find('who').textContent = scene && !scene.can_touch ? 'This page shows what is felt; the hand is elsewhere.' : '';
  if (state.holder === me) feedBack(touches ? force : 0);
}

// What says a force without a force device: sound and vibration.

let audio = null, vibratedAt = 0;
find('sound').addEventListener('click', () => {
  if (audio) {
    audio.context.close();
    audio = null;
  } else {
    const context = new AudioContext(), gain = context.createGain(), tone = context.createOscillator();
    tone.frequency.value = 180;
    gain.gain.value = 0;
    tone.connect(gain).connect(context.destination);
    tone.start();
    audio = {context, gain};
  }
  find('sound').setAttribute('aria-pressed', String(audio !== null));
});

function feedBack(force) {
  const share = Math.min(1, force / kMostForce), now = performance.now();
  audio?.gain.gain.setTargetAtTime(0.25 * share, audio.context.currentTime, 0.02);
  if (share <= 0.02 || now - vibratedAt < 60) return;
  vibratedAt = now;
  if (headset) {
    for (const source of headset.session.inputSources) source.gamepad?.hapticActuators?.[0]?.pulse?.(share, 60);
    return;
  }
  if (navigator.userActivation?.hasBeenActive) navigator.vibrate?.(Math.round(5 + 35 * share));
  for (const pad of navigator.getGamepads?.() ?? [])
    pad?.vibrationActuator?.playEffect?.('dual-rumble', {duration: 60, weakMagnitude: share, strongMagnitude: share});
}

// The eye, and what the pointer does.

function eye() {
  const {centre, distance, azimuth, elevation} = camera, c = Math.cos(elevation);
  const way = [c * Math.sin(azimuth), Math.sin(elevation), c * Math.cos(azimuth)];
  return eyeAt(add(centre, way, distance), centre, kHeightAngle, canvas.width / canvas.height);
}

const place = () => state?.place ?? [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const shares = (event) => [event.clientX / canvas.clientWidth, event.clientY / canvas.clientHeight];
/** The way of the ray through a place of the picture; one along the eye's axis. */
function rayOf(from, [x, y]) {
  const [l, r, d, u] = from.tan;
  return add(add(scale(from.right, l + x * (r - l)), from.up, u - y * (u - d)), from.back, -1);
}

const pointers = new Map();
let hand = null;  // a pointer that touches: {ray, from, depth, begun; since: when it began to move in; held: palpate has it}
let push = 0;     // m, beyond the surface

function reach(at) {
  const from = eye(), depth = view.depthAt(from, place(), ...at);
  return depth === null ? null : {from: from.from, ray: rayOf(from, at), depth};
}

canvas.addEventListener('pointerdown', (event) => {
  canvas.setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, {x: event.clientX, y: event.clientY, turns: event.button === 2});
  if (!scene) return;
  if (pointers.size > 1) { letGo(); return; }
  if (event.button !== 0 || !scene.can_touch || (state && state.holder !== 0 && state.holder !== me)) return;
  const hit = reach(shares(event));
  if (hit) {
    push = 2 * ball() * Number(find('depth').value);
    hand = {...hit, since: null, begun: performance.now()};
  }
});
canvas.addEventListener('pointermove', (event) => {
  const last = pointers.get(event.pointerId);
  if (!scene) return;
  if (!last) return;
  const dx = event.clientX - last.x, dy = event.clientY - last.y;
  if (pointers.size === 2) {
    const others = [...pointers.entries()].filter(([id]) => id !== event.pointerId)[0][1];
    const before = Math.hypot(last.x - others.x, last.y - others.y), after = Math.hypot(event.clientX - others.x, event.clientY - others.y);
    if (before > 0 && after > 0) zoom(before / after);
    turn(0.5 * dx, 0.5 * dy);
  } else if (hand) {
    // Beside the volume the hand goes on at its depth.
    const at = shares(event), from = eye(), depth = view.depthAt(from, place(), ...at) ?? hand.depth;
    hand = {...hand, from: from.from, ray: rayOf(from, at), depth};
  } else {
    turn(dx, dy);
  }
  Object.assign(last, {x: event.clientX, y: event.clientY});
});
for (const name of ['pointerup', 'pointercancel'])
  canvas.addEventListener(name, (event) => {
    pointers.delete(event.pointerId);
    letGo();
  });
canvas.addEventListener('contextmenu', (event) => event.preventDefault());
canvas.addEventListener('wheel', (event) => {
  event.preventDefault();
  if (!scene) return;
  const notches = Math.max(-3, Math.min(3, event.deltaY / 100));
  if (hand) setPush(push - notches * kPushPerNotch * ball());
  else zoom(0.9 ** -notches);
}, {passive: false});
find('depth').addEventListener('input', () => setPush(2 * ball() * Number(find('depth').value)));

function setPush(m) {
  push = Math.max(0, Math.min(2 * ball(), m));
  find('depth').value = push / (2 * ball());
}
function turn(dx, dy) {
  camera.azimuth -= 3 * dx / canvas.clientHeight;
  camera.elevation = Math.max(-kSteepest, Math.min(kSteepest, camera.elevation + 3 * dy / canvas.clientHeight));
}
function zoom(factor) {
  camera.distance = Math.max(0.3 * ball(), Math.min(20 * ball(), camera.distance * factor));
}
function letGo() {
  if (!hand) return;
  hand = null;
  send({hand: null});
  feedBack(0);
}
window.addEventListener('blur', letGo);

/** The depth at which a ray enters the box around the volumes. */
function entry({from, ray}) {
  const near = [0, 1, 2].map((a) => {
    const way = Math.abs(ray[a]) > 1e-9 ? ray[a] : 1e-9;
    return Math.min((scene.low_m[a] - from[a]) / way, (scene.high_m[a] - from[a]) / way);
  });
  return Math.max(0.02, ...near);
}

/**
 * Where the hand is put now: in front, until palpate gives it a force (its start gate opens in free space only), then on a way that meets
 * the surface from outside.
 */
function handPlace() {
  const now = performance.now();
  if (hand.since === null && ((state?.holder === me && !state.cause) || now - hand.begun > kGate_ms)) hand.since = now;
  const share = hand.since === null ? 0 : Math.min(1, (now - hand.since) / 1000 / kApproach_s);
  const outside = Math.min(hand.depth, entry(hand)), inside = hand.depth + push / length(hand.ray);
  return add(hand.from, hand.ray, outside + share * (inside - outside));
}

// Apart from drawing, which may be slower: palpate lets go of a hand that is silent.
setInterval(() => {
  if (hand) send({hand: handPlace()});
}, 20);

// Playing.

const isPlaying = () => state && state.rate !== 0;
function togglePlay() { send({play: !isPlaying()}); }
find('play').addEventListener('click', togglePlay);
find('time').addEventListener('input', () => send({scrub: Number(find('time').value)}));
document.addEventListener('keydown', (event) => {
  if (event.key !== ' ' || ['BUTTON', 'INPUT'].includes(event.target.tagName)) return;
  event.preventDefault();
  togglePlay();
});
find('help-button').addEventListener('click', () => {
  find('help').hidden = !find('help').hidden;
  find('help-button').setAttribute('aria-expanded', String(!find('help').hidden));
});

// The picture.

/** A place in volume space, by shares of the edges of the box that the data fill. */
function inBox(share) {
  return scene.box.axes.reduce((sum, axis, a) => add(sum, axis, share[a] * scene.box.edges_m[a]), scene.box.corner_m);
}

/** Edges of the data, and the hand: a ball at the surface that it touches, and the force as an arrow. */
function things() {
  const size = ball() / 0.1, at = place(), list = [];
  // At least as wide as a pixel.
  const edge = Math.max(0.0004 * size, 1.4 * Math.tan(kHeightAngle / 2) * camera.distance / canvas.height);
  const corner = (c) => point(at, inBox([c & 1, c >> 1 & 1, c >> 2]));
  for (let c = 0; c < 8; ++c)
    for (let a = 0; a < 3; ++a)
      if (!(c >> a & 1))
        list.push({from: corner(c), to: corner(c | 1 << a), radius: edge, toRadius: edge, colour: [0.42, 0.46, 0.54]});
  if (!state || (scene.can_touch && state.holder === 0)) return list;
  const share = Math.min(1, length(state.force_n) / kMostForce), radius = scene.tool_m > 0 ? scene.tool_m : 0.007 * size;
  const ballAt = state.touches ? state.proxy_m : state.probe_m;
  const colour = state.touches ? [0.25 - 0.15 * share, 0.95 - 0.7 * share, 1] : [0.8, 0.83, 0.88];
  list.push({from: ballAt, to: ballAt, radius, toRadius: radius, colour});
  const way = scale(state.force_n, 0.008 * size), thick = 0.0012 * size, long = length(way);
  if (long > 2 * thick) {
    const neck = add(state.proxy_m, way, 1 - Math.min(6 * thick, 0.5 * long) / long), arrow = [1, 0.62, 0.18];
    list.push({from: state.proxy_m, to: neck, radius: thick, toRadius: thick, colour: arrow});
    list.push({from: neck, to: add(state.proxy_m, way), radius: 2.4 * thick, toRadius: 0.15 * thick, colour: arrow});
  }
  return list;
}

/** The letters of the patient's sides, beside the faces of the data. */
function placeLetters(from) {
  const beyond = 0.1 * ball() / Math.max(length(place().slice(0, 3)), 1e-9);
  [...find('letters').children].forEach((letter, n) => {
    const axis = n >> 1, side = n % 2, share = [0.5, 0.5, 0.5];
    share[axis] = side;
    letter.textContent = scene.sides[n];
    const at = add(inBox(share), scene.box.axes[axis], side ? beyond : -beyond);
    const to = add(point(place(), at), from.from, -1), depth = -dot(to, from.back);
    letter.hidden = depth <= 0;
    letter.style.left = `${canvas.clientWidth * (0.5 + 0.5 * dot(to, from.right) / depth / from.tan[1])}px`;
    letter.style.top = `${canvas.clientHeight * (0.5 - 0.5 * dot(to, from.up) / depth / from.tan[3])}px`;
  });
}

function phaseText() {
  const count = scene.times_s.length;
  if (count < 2) return '';
  const {frame, phase} = pointerAt(scene, timeNow());
  return `frame ${(frame + phase).toFixed(1)} of ${count}, ${timeNow().toFixed(2)} s`;
}

function resize() {
  const most = Math.min(2, devicePixelRatio || 1), width = Math.max(1, Math.round(canvas.clientWidth * most * resolution));
  const height = Math.max(1, Math.round(canvas.clientHeight * most * resolution));
  if (canvas.width === width && canvas.height === height) return;
  canvas.width = width;
  canvas.height = height;
}

/** Fewer pixels where the picture takes too long, more where there is time. */
function adapt(now) {
  const took = now - lastDrawn;
  lastDrawn = now;
  if (fixed || document.hidden) return;
  if (took > kSlow_ms) resolution = Math.max(kLeastScale, resolution * Math.max(0.5, Math.sqrt(kSlow_ms / took)));
  else if (took < kQuick_ms) resolution = Math.min(1, 1.02 * resolution);
}

function drawPicture(now) {
  resize();
  const from = eye();
  view.bringTo(timeNow());
  view.draw(from, place(), things(), null, [0, 0, canvas.width, canvas.height]);
  placeLetters(from);
  find('phase').textContent = phaseText();
  const long = scene.cycle_s > 0 ? scene.cycle_s : scene.times_s.at(-1);
  if (document.activeElement !== find('time') || isPlaying()) find('time').value = !(long > 0) ? 0 : scene.cycle_s > 0 ? (timeNow() % long) / long : timeNow() / long;
  adapt(now);
}

function loop(now) {
  requestAnimationFrame(loop);
  if (!scene || !view || headset || view.gl.isContextLost()) return;
  drawPicture(now);
}
requestAnimationFrame(loop);
canvas.addEventListener('webglcontextlost', (event) => {
  event.preventDefault();
  say('The graphics driver has restarted; drawing again.');
});
canvas.addEventListener('webglcontextrestored', () => {
  view = null;
  scene = null;
});

// A headset: the volume half a metre in front of the person; a controller or the tip of a forefinger is the hand.

let headset = null;
async function offerHeadset() {
  const can = await navigator.xr?.isSessionSupported('immersive-vr').catch(() => false);
  find('headset').hidden = !can;
}
find('headset').addEventListener('click', async () => {
  if (headset) { headset.session.end(); return; }
  try {
    const session = await navigator.xr.requestSession('immersive-vr', {optionalFeatures: ['hand-tracking']});
    const layer = new XRWebGLLayer(session, view.gl, {antialias: false, depth: false, framebufferScaleFactor: 0.7});
    session.updateRenderState({baseLayer: layer, depthNear: 0.02});
    const space = await session.requestReferenceSpace('local');
    // A ball of 18 cm, half a metre away; room = middle + size (world - centre).
    headset = {session, layer, space, size: 0.18 / ball(), middle: [0, -0.1, -0.5], touched: false};
    session.addEventListener('end', () => {
      if (headset?.touched) send({hand: null});
      headset = null;
    });
    session.requestAnimationFrame(headsetFrame);
  } catch (error) {
    say(`The headset can not be used: ${error.message}`);
  }
});

const worldFromRoom = (p) => add(camera.centre, add(p, headset.middle, -1), 1 / headset.size);

function headsetFrame(now, frame) {
  if (!headset) return;
  headset.session.requestAnimationFrame(headsetFrame);
  const pose = frame.getViewerPose(headset.space);
  sendHeadsetHand(frame);
  if (!pose) return;
  view.bringTo(timeNow());
  const shown = things();
  let first = null;
  for (const one of pose.views) {
    const m = Array.from(one.transform.matrix), p = one.projectionMatrix, port = headset.layer.getViewport(one);
    const eyeHere = {from: worldFromRoom(m.slice(12, 15)), right: m.slice(0, 3), up: m.slice(4, 7), back: m.slice(8, 11),
      tan: [(p[8] - 1) / p[0], (p[8] + 1) / p[0], (p[9] - 1) / p[5], (p[9] + 1) / p[5]]};
    first ??= eyeHere;
    view.draw(eyeHere, place(), shown, headset.layer.framebuffer, [port.x, port.y, port.width, port.height], first);
  }
}

function sendHeadsetHand(frame) {
  let tip = null;
  for (const source of headset.session.inputSources) {
    const joint = source.hand?.get('index-finger-tip');
    const pose = joint ? frame.getJointPose?.(joint, headset.space) : source.targetRayMode === 'tracked-pointer'
      ? frame.getPose(source.targetRaySpace, headset.space) : null;
    if (!pose || pose.emulatedPosition) continue;
    const {x, y, z} = pose.transform.position;
    if (!tip || source.handedness === 'right') tip = [x, y, z];
  }
  if (tip && scene.can_touch) send({hand: worldFromRoom(tip)});
  else if (headset.touched) send({hand: null});
  headset.touched = tip !== null;
}

// For scripts and tests: pictures of a chosen size at a chosen time, without edges and letters.
globalThis.palpate = {
  get state() { return state; },
  get scene() { return scene; },
  get me() { return me; },
  get view() { return view; },
  get eye() { return eye(); },
  get headset() { return headset; },
  send,
  shot(size, time_s) {
    const first = eyeBefore(scene.corners_m, 1, kHeightAngle);
    canvas.width = canvas.height = size;
    view.bringTo(time_s);
    view.draw(eyeAt(add(first.centre, first.way, first.distance), first.centre, kHeightAngle, 1), place(), [], null, [0, 0, size, size]);
    const pixels = new Uint8Array(4 * size * size);
    view.gl.readPixels(0, 0, size, size, view.gl.RGBA, view.gl.UNSIGNED_BYTE, pixels);
    return pixels;
  },
};
connect();
