"""A host in Python: replays a recording of a scene with a known motion, and draws its first frame.
usage: replay_host.py FIELDS RECORDING PICTURE.ppm SIZE EYE MIDDLE FRAME...; EYE, MIDDLE: x,y,z in m
Prints a JSON object."""

import json
import sys

import palpate

fields, recording, picture, size, eye_m, middle_m, *frames = sys.argv[1:]
with palpate.Session(frames, fields=fields, workspace_radius_m=0.2) as session:
    replay = session.replay(recording)
    session.play(False)
    session.scrub(0.0)
    # Far away, the hand is not in the picture.
    session.tick((0.0, 0.0, 50.0), time_ns=1)
    pixels = session.picture([float(x) for x in eye_m.split(",")], [float(x) for x in middle_m.split(",")], width=int(size), height=int(size))
    with open(picture, "wb") as file:
        file.write(b"P6\n%d %d\n255\n" % (pixels.shape[1], pixels.shape[0]) + pixels[..., :3].tobytes())
print(json.dumps({"ticks": replay["ticks"], "different": replay["different"]}))
