#!/usr/bin/env python3
"""The live page of `palpate serve --web`: clients of its messages, and the page itself in Debian's chromium, headless.

usage: live_page_test.py PALPATE [TEST...]
Exit status 77: chromium is not installed, and that is said; what needs no browser was tested.
"""

import base64
import json
import os
import select
import shutil
import socket
import ssl
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

PALPATE = os.path.abspath(sys.argv[1])
PATIENCE_S = 120
# A headset with one controller: two eyes side by side in a picture of its own, as WebXR says.
HEADSET = """
class Layer {
  constructor(session, gl) {
    const texture = gl.createTexture();
    this.framebuffer = gl.createFramebuffer();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, 128, 64);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    made.layer = this;
  }
  getViewport(view) { return {x: view.eye === 'left' ? 0 : 64, y: 0, width: 64, height: 64}; }
}
const made = globalThis.madeHeadset = {tip: [0, 0.4, -0.5], frames: 0, pulses: 0};
const at = ([x, y, z]) => ({position: {x, y, z}, matrix: new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1])});
const controller = {handedness: 'right', targetRayMode: 'tracked-pointer', targetRaySpace: 'controller',
  gamepad: {hapticActuators: [{pulse() { ++made.pulses; }}]}};
class HeadsetSession extends EventTarget {
  inputSources = [controller];
  updateRenderState() {}
  async requestReferenceSpace() { return 'room'; }
  requestAnimationFrame(draw) {
    setTimeout(() => {
      ++made.frames;
      draw(performance.now(), {
        getViewerPose: () => ({views: ['left', 'right'].map((eye) => ({eye, transform: at([eye === 'left' ? -0.03 : 0.03, 0, 0]),
          projectionMatrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -0.04, 0]}))}),
        getPose: () => made.tip && {transform: at(made.tip), emulatedPosition: false},
      });
    }, 30);
  }
}
globalThis.XRWebGLLayer = Layer;
Object.defineProperty(navigator, 'xr', {value: {isSessionSupported: async () => true, requestSession: async () => new HeadsetSession()}});
"""
# Peak signal to noise of what the page draws at a frame of the sequence, against a picture file, dB.
AGREEMENT = """(async () => {
  const size = %d, file = new Image();
  file.src = 'data:image/png;base64,%s';
  await file.decode();
  const canvas = Object.assign(document.createElement('canvas'), {width: size, height: size}), context = canvas.getContext('2d');
  context.drawImage(file, 0, 0);
  const wanted = context.getImageData(0, 0, size, size).data, times = palpate.scene.times_s, k = Math.floor(%f);
  const next = k + 1 < times.length ? times[k + 1] : palpate.scene.cycle_s;
  const drawn = palpate.shot(size, times[k] + (%f - k) * (next - times[k]));
  let sum = 0;
  for (let y = 0; y < size; ++y)
    for (let x = 0; x < size; ++x)
      for (let c = 0; c < 3; ++c) sum += (drawn[4 * ((size - 1 - y) * size + x) + c] - wanted[4 * (y * size + x) + c]) ** 2;
  return 10 * Math.log10(255 ** 2 / Math.max(sum / (3 * size * size), 1e-9));
})()"""


def make_data(folder):
    """A heart that beats, of 4 x 48^3 voxels, with its motion from frame to frame ("steps") and one for the whole sequence ("whole")."""
    run = lambda *arguments: subprocess.run([PALPATE, *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    run("phantom", "heart", "--size", "48", "--frames", "4", "-o", "heart.seq.nrrd", "--truth", "truth")
    run("motion", "heart.seq.nrrd", "-o", "whole", "--quiet")
    os.mkdir(os.path.join(folder, "steps"))
    for k in range(4):
        name = f"{k}_to_{(k + 1) % 4}.mha"
        os.rename(os.path.join(folder, "truth", "truth_" + name), os.path.join(folder, "steps", "motion_" + name))


def setUpModule():
    global data
    data = tempfile.TemporaryDirectory()
    make_data(data.name)


def tearDownModule():
    data.cleanup()


def scene(motion):
    """The arguments of a scene."""
    return os.path.join(data.name, "heart.seq.nrrd"), "--fields", os.path.join(data.name, motion)


class Served:
    """A palpate that serves a page, until it is stopped."""

    def __init__(self, *arguments):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.process = subprocess.Popen([PALPATE, *arguments, "--web", str(self.port)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.address = next((line.split()[1] for line in self.process.stdout if line.startswith("Page      https")), None)
        assert self.address, "palpate has ended"
        # What else it says is not waited for.
        threading.Thread(target=lambda: self.process.stdout.read(), daemon=True).start()

    def stop(self):
        self.process.terminate()
        self.process.wait(PATIENCE_S)


class Client:
    """A client of the page's messages (RFC 6455)."""

    def __init__(self, address):
        _, _, place, token, _ = address.split("/")
        host, port = place.split(":")
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        self.socket = context.wrap_socket(socket.create_connection((host, int(port)), PATIENCE_S))
        self.socket.sendall((f"GET /{token}/state HTTP/1.1\r\nHost: {place}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n").encode())
        self.buffer = b""
        while b"\r\n\r\n" not in self.buffer:
            self.buffer += self.socket.recv(4096)
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        assert head.startswith(b"HTTP/1.1 101"), head
        self.me = self.read()["you"]

    def send(self, text):
        body = text.encode()
        size = bytes([0x80 | len(body)]) if len(body) < 126 else struct.pack("!BH", 0x80 | 126, len(body))
        self.socket.sendall(b"\x81" + size + bytes(4) + body)

    def take(self, count):
        while len(self.buffer) < count:
            got = self.socket.recv(65536)
            if not got:
                raise EOFError
            self.buffer += got
        taken, self.buffer = self.buffer[:count], self.buffer[count:]
        return taken

    def read(self):
        """The next message; why the server closes, if it does."""
        kind, size = self.take(2)
        if size == 126:
            size = struct.unpack("!H", self.take(2))[0]
        body = self.take(size)
        return json.loads(body) if kind & 15 == 1 else body[2:].decode()

    def wait(self, wanted):
        end = time.time() + PATIENCE_S
        while time.time() < end:
            state = self.read()
            if isinstance(state, str) or wanted(state):
                return state
        raise TimeoutError

    def hold(self, place_m):
        """Until this client is the hand."""
        end = time.time() + PATIENCE_S
        while time.time() < end:
            self.send(json.dumps({"hand": place_m}))
            if self.read()["holder"] == self.me:
                return
        raise TimeoutError

    def close(self):
        self.socket.close()


class Browser:
    """Chromium, driven by its debugging pipe."""

    def __init__(self, profile):
        commands, self.commands = os.pipe()
        self.answers, answers = os.pipe()

        def pipes():
            first, second = os.dup(commands), os.dup(answers)
            os.dup2(first, 3)
            os.dup2(second, 4)

        self.process = subprocess.Popen(
            ["chromium", "--headless", "--no-sandbox", "--remote-debugging-pipe", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             "--ignore-gpu-blocklist", "--ignore-certificate-errors", "--window-size=500,600", "--user-data-dir=" + profile, "about:blank"],
            preexec_fn=pipes, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(commands)
        os.close(answers)
        self.buffer, self.count, self.session = b"", 0, None
        page = next(one for one in self.call("Target.getTargets")["targetInfos"] if one["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
        self.call("Page.enable")

    def call(self, method, **parameters):
        self.count += 1
        message = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.commands, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self.buffer:
                if not select.select([self.answers], [], [], PATIENCE_S)[0]:
                    raise TimeoutError(method)
                got = os.read(self.answers, 1 << 20)
                if not got:
                    raise EOFError("chromium has ended")
                self.buffer += got
            one, self.buffer = self.buffer.split(b"\0", 1)
            answer = json.loads(one)
            if answer.get("id") == self.count:
                if "error" in answer:
                    raise RuntimeError(answer["error"])
                return answer["result"]

    def run(self, script):
        got = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in got:
            raise RuntimeError(json.dumps(got["exceptionDetails"]))
        return got["result"].get("value")

    def wait(self, script, patience_s=PATIENCE_S):
        end = time.time() + patience_s
        while time.time() < end:
            got = self.run(script)
            if got:
                return got
            time.sleep(0.05)
        raise TimeoutError(f"{script}; the page says: {self.run('document.body.innerText')}")

    def open(self, address):
        self.call("Page.navigate", url=address)
        # Chromium drops clicks on a page that it has not painted yet.
        self.wait("globalThis.palpate?.scene != null && palpate.state?.time_s != null && performance.getEntriesByType('paint').length > 0")

    def close(self):
        self.call("Browser.close")
        self.process.wait(PATIENCE_S)
        os.close(self.commands)
        os.close(self.answers)


class Messages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.served = Served("serve", *scene("whole"), "--wall", "region")
        cls.address = cls.served.address

    @classmethod
    def tearDownClass(cls):
        cls.served.stop()

    def test_what_is_no_pose_is_refused_with_one_reason(self):
        for text, reason in (
                ("garbage", "no JSON object"), ("[1]", "no JSON object"), ('{"hand": null, "play": true}', "no JSON object"),
                ('{"hand": [0, 0]}', "three numbers"), ('{"hand": [0, 0, NaN]}', "no JSON object"), ('{"hand": [0, 0, "1"]}', "three numbers"),
                ('{"hand": [0, 0, 1e999]}', "no JSON object"), ('{"hand": [0, 0, 1e300]}', "three numbers"), ('{"hand": ' + "[" * 400, "no JSON object"),
                ('{"scrub": 2}', "from 0 to 1"), ('{"play": 1}', "true nor false"), ('{"file": "/etc/passwd"}', "not known")):
            client = Client(self.address)
            client.send(text)
            self.assertIn(reason, client.wait(lambda state: False), text)
            client.close()

    def test_one_client_at_a_time_is_the_hand(self):
        first, second = Client(self.address), Client(self.address)
        first.hold([0, 0, 0.09])
        # Silence lets go; the second one may then touch.
        second.wait(lambda state: state["holder"] == first.me)
        second.wait(lambda state: state["holder"] == 0)
        second.hold([0, 0, 0.05])
        # While it holds, the first one does not move it. A pause of this test would let go: then from the beginning.
        end, held = time.time() + PATIENCE_S, 0
        while held < 20 and time.time() < end:
            second.send('{"hand": [0, 0, 0.05]}')
            first.send('{"hand": [0.05, 0, 0]}')
            state = second.read()
            held = held + 1 if state["holder"] == second.me else 0
            if state["holder"] == first.me:
                second.hold([0, 0, 0.05])
        self.assertEqual(held, 20)
        self.assertAlmostEqual(state["probe_m"][0], 0.0, 3)
        # Leaving lets go.
        second.close()
        first.wait(lambda state: state["holder"] in (0, first.me))
        first.close()

    def test_a_page_moves_no_hand_of_a_device(self):
        # The simulated hand is at rest.
        served = Served("feel", *scene("whole"), "--device", "simulated", "--hand", "none", "--headset", "off", "--seconds", "100")
        try:
            client = Client(served.address)
            before = client.wait(lambda state: True)
            for _ in range(10):
                client.send('{"hand": [0.05, 0.05, 0.05]}')
                state = client.read()
            self.assertEqual(state["holder"], 0)
            self.assertLess(max(abs(a - b) for a, b in zip(before["probe_m"], state["probe_m"])), 0.005)
            client.close()
        finally:
            served.stop()


@unittest.skipUnless(shutil.which("chromium"), "chromium is not installed")
class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.served = Served("serve", *scene("whole"), "--wall", "region")
        cls.address = cls.served.address
        cls.profile = tempfile.TemporaryDirectory()
        cls.browser = Browser(cls.profile.name)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.served.stop()
        cls.profile.cleanup()

    def compare(self, motion, address):
        """What the page draws, against what palpate draws without shadows: the page has none."""
        size, frames = 128, (0.0, 1.5)
        files = {}
        for frame in frames:
            file = os.path.join(self.profile.name, f"{frame}.png")
            subprocess.run([PALPATE, "view", *scene(motion), "--picture", file, "--frame", str(frame), "--no-box", "--no-slices", "--quiet",
                            "--shadows", "0", "--picture-size", str(size)], check=True)
            with open(file, "rb") as picture:
                files[frame] = base64.b64encode(picture.read()).decode()
        self.browser.open(address + "#fixed")
        self.assertEqual(self.browser.run("palpate.scene.whole"), motion == "whole")

        def agreement(file, frame):
            return self.browser.run(AGREEMENT % (size, files[file], frame, frame))

        other = agreement(0.0, 2.0)
        for frame in frames:
            same = agreement(frame, frame)
            self.assertGreater(same, 30.0, f"frame {frame}")
            self.assertGreater(same, other + 3.0, f"frame {frame}: another phase is another picture")

    def test_draws_what_palpate_draws_of_one_motion(self):
        self.compare("whole", self.address)

    def test_draws_what_palpate_draws_of_steps(self):
        served = Served("serve", *scene("steps"))
        try:
            self.compare("steps", served.address)
        finally:
            served.stop()

    def test_a_pointer_touches_and_lets_go(self):
        self.browser.open(self.address)
        middle = self.browser.run("[innerWidth / 2, innerHeight / 2]")

        def mouse(kind):
            self.browser.call("Input.dispatchMouseEvent", type=kind, x=middle[0], y=middle[1], button="left", clickCount=1)

        # Where the page is heard too late, palpate lets go, and gives no force until the hand has been away: a person presses again.
        end = time.time() + PATIENCE_S
        while True:
            mouse("mousePressed")
            try:
                force = self.browser.wait("palpate.state.holder === palpate.me && Math.hypot(...palpate.state.force_n) > 0.5 && "
                                          "palpate.state.force_n", 10)
                break
            except TimeoutError:
                if time.time() > end:
                    raise
            mouse("mouseReleased")
            self.browser.wait("palpate.state.holder === 0")
        self.assertGreater(force[2], 0.0, "away from the heart, towards the person")
        mouse("mouseReleased")
        self.browser.wait("palpate.state.holder === 0 && Math.hypot(...palpate.state.force_n) === 0")

    def test_a_headset_draws_both_eyes_and_its_controller_touches(self):
        script = self.browser.call("Page.addScriptToEvaluateOnNewDocument", source=HEADSET)["identifier"]
        try:
            self.browser.open(self.address)
            self.browser.wait("!document.getElementById('headset').hidden")
            self.browser.run("document.getElementById('headset').click()")
            self.browser.wait("madeHeadset.frames > 2 && palpate.state.holder === palpate.me")
            # From above to the middle of the picture, 1 cm a step; from above again after a pause in which palpate let go.
            self.browser.run("""setInterval(() => {
              if (!madeHeadset.tip) return;
              if (palpate.state?.holder !== palpate.me || palpate.state.cause) madeHeadset.tip[1] = 0.4;
              else if (madeHeadset.tip[1] > -0.1) madeHeadset.tip[1] -= 0.01;
            }, 30)""")
            self.browser.wait("palpate.state.touches && madeHeadset.pulses > 0")
            rows = self.browser.run("""(() => {
              const gl = document.getElementById('picture').getContext('webgl2'), pixels = new Uint8Array(4 * 128 * 64);
              gl.bindFramebuffer(gl.FRAMEBUFFER, madeHeadset.layer.framebuffer);
              gl.readPixels(0, 0, 128, 64, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
              const bright = [0, 0];
              for (let n = 0; n < pixels.length; n += 4) if (pixels[n] > 90) ++bright[n / 4 % 128 < 64 ? 0 : 1];
              return bright;
            })()""")
            self.assertGreater(min(rows), 50, "both eyes see the volume")
            # A controller that is not tracked any more lets go.
            self.browser.run("madeHeadset.tip = null")
            self.browser.wait("palpate.state.holder === 0")
        finally:
            self.browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)


if __name__ == "__main__":
    program = unittest.main(argv=[sys.argv[0], *sys.argv[2:]], exit=False)
    if not program.result.wasSuccessful():
        sys.exit(1)
    sys.exit(77 if program.result.skipped else 0)
