"""The script for Blender, in Blender. Oracle: a ball whose radius, place and path are known, in an image with permuted axes and unequal spacings.

    blender_test.py MODULES SCRIPT DEBIAN_ROOT     # palpate's modules; palpate_wall.py; tests/support/debian_root.sh, for where there is no Blender

Exits with 77 where Blender can not be had.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

SHAPE, SPACING, ORIGIN = (18, 20, 24), (1.0, 1.25, 1.5), (-10.0, 20.0, 300.0)
# The index axis x points along P, y along S, z along L; or along -L, so that the grid is left-handed.
DIRECTIONS = {"right": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]), "left": np.array([[0, 0, -1], [1, 0, 0], [0, 1, 0]])}
PATH = [(0.0, 0.0, 0.0), (0.5, 1.0, 0.0), (1.0, 1.5, -0.5)]  # of the ball, LPS mm
RADIUS_MM = 6.0


def start_blender(modules, script, debian_root):
    environment, program = {**os.environ, "PYTHONPATH": modules}, shutil.which("blender")
    if not program:
        fetched = subprocess.run(["bash", debian_root, "blender"], stdout=subprocess.PIPE, text=True)
        if fetched.returncode != 0:
            sys.exit(fetched.returncode)
        usr = Path(fetched.stdout.strip()) / "usr"
        program = usr / "bin/blender"
        environment |= {"LD_LIBRARY_PATH": f"{next(usr.glob('lib/*-linux-gnu'))}:{usr}/lib", "BLENDER_SYSTEM_SCRIPTS": f"{usr}/share/blender/scripts",
                        "BLENDER_SYSTEM_DATAFILES": f"{usr}/share/blender/datafiles"}

    def run(file, *arguments):
        return subprocess.run([program, "-b", "--factory-startup", "--python-use-system-env", "--python-exit-code", "1", "-P", file, "--", *map(str, arguments)],
                              env=environment, capture_output=True, text=True)

    with tempfile.TemporaryDirectory() as folder:
        for hand, direction in DIRECTIONS.items():
            frames = Path(folder) / hand
            frames.mkdir()
            write(frames, direction)
            done = run(script, frames, "--iso-value", 500, "--preset", "fast", "--cyclic", "--fps", 30, "-o", frames / "wall.blend")
            assert done.returncode == 0 and "3 shape keys" in done.stdout, done.stdout + done.stderr
        wrong = run(script, frames, "--iso-value", 5000, "--preset", "fast", "-o", frames / "none.blend")
        assert wrong.returncode == 2 and "palpate: the value 5000 is nowhere" in wrong.stderr and "Traceback" not in wrong.stderr, wrong.stderr
        assert not (frames / "none.blend").exists()
        checked = run(__file__, folder)
        print(checked.stdout + checked.stderr)
        sys.exit(checked.returncode)


def write(folder, direction):
    index = np.stack(np.meshgrid(*(np.arange(n) for n in SHAPE), indexing="ij"), axis=-1)[..., ::-1] - (np.array(SHAPE[::-1]) - 1) / 2
    for k, centre in enumerate(PATH):
        l, p, s = np.moveaxis((index * SPACING) @ direction.T - centre, -1, 0)
        texture = 60 * np.sin(0.9 * l) * np.sin(0.7 * p) * np.sin(0.8 * s)
        frame = ((1000 + texture) / (1 + np.exp(np.sqrt(l**2 + p**2 + s**2) - RADIUS_MM))).astype("<f4")
        head = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nTransformMatrix = {' '.join(map(str, direction.T.reshape(-1)))}\n"
                f"Offset = {' '.join(map(str, ORIGIN))}\nElementSpacing = {' '.join(map(str, SPACING))}\nDimSize = {' '.join(map(str, SHAPE[::-1]))}\n"
                "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n")
        (folder / f"frame_{k}.mha").write_bytes(head.encode() + frame.tobytes())


def check(folder):
    import bpy

    for hand, direction in DIRECTIONS.items():
        bpy.ops.wm.open_mainfile(filepath=f"{folder}/{hand}/wall.blend")
        wall, scene = bpy.data.objects["wall"], bpy.context.scene
        middle = 0.001 * (np.array(ORIGIN) + direction @ ((np.array(SHAPE[::-1]) - 1) / 2 * SPACING))

        def shown(frame, subframe=0.0):
            scene.frame_set(frame, subframe=subframe)
            mesh = wall.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
            return np.array([vertex.co for vertex in mesh.vertices])

        # The ball, where it is in each frame; the frames are a third of a second apart, and the last leads back to the first.
        assert (scene.frame_start, scene.frame_end) == (1, 30)
        for frame, k in ((1, 0), (11, 1), (21, 2), (31, 0)):
            found = shown(frame)
            assert np.allclose(found.mean(axis=0), middle + 0.001 * np.array(PATH[k]), atol=0.0003), (hand, frame, found.mean(axis=0) - middle)
            radii = np.linalg.norm(found - found.mean(axis=0), axis=1)
            assert np.allclose(radii, 0.001 * RADIUS_MM, atol=0.0008), (hand, radii.min(), radii.max())
        assert np.allclose(shown(3, 0.5), 0.75 * shown(1) + 0.25 * shown(11), atol=1e-6)
        # Closed, and its normals point outwards.
        assert len(wall.data.vertices) - len(wall.data.edges) + len(wall.data.polygons) == 2
        out = [polygon.normal.dot(polygon.center - sum((v.co for v in wall.data.vertices), polygon.center * 0) / len(wall.data.vertices))
               for polygon in list(wall.data.polygons)[::25]]
        assert min(out) > 0.0, (hand, min(out))
        assert wall["verdict"] in ("ok", "suspect", "failed")
    print("The wall moves in Blender as the ball does")


if len(sys.argv) == 4 and "--" not in sys.argv:
    start_blender(*sys.argv[1:])
else:
    check(sys.argv[-1])
