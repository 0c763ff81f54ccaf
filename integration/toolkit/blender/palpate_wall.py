"""palpate in Blender: the wall of a moving volume as a mesh that moves, by shape keys.

    blender -b --python-use-system-env -P palpate_wall.py -- SEQUENCE --iso-value 90 --cyclic -o heart.blend

SEQUENCE is what palpate opens: a folder, a 4D file, files. The wall is the surface of one value in the reference frame. Each frame of the sequence is a
shape key; their values are animated in time. m, with x to the patient's left, y to the back, z to the head. In a script of Blender's: add_wall().
"""

import argparse
import sys

import bpy
import numpy as np

import palpate


def surface(values, iso):
    """The surface of a value in a volume (z, y, x) by naive surface nets (Gibson 1998): a vertex in each cell of 2 x 2 x 2 samples that the surface
    crosses, at the mean of the crossings of its edges. Returns vertices, index (x, y, z), shape (n, 3), and quads, shape (m, 4), whose right-hand
    normals point to smaller values. At the border of the volume it is open."""
    values = np.asarray(values, dtype=np.float32).T  # (x, y, z)
    inside = values > iso
    cells = np.array(values.shape) - 1
    sums, counts = np.zeros((*cells, 3), dtype=np.float32), np.zeros(cells, dtype=np.int32)

    def part(array, first, size):
        return array[tuple(slice(begin, begin + n) for begin, n in zip(first, size))]

    for axis in range(3):
        step = np.eye(3, dtype=int)[axis]
        for corner in np.ndindex(2, 2, 2):
            if corner[axis]:
                continue
            a, b = part(values, corner, cells), part(values, corner + step, cells)
            crossed = np.nonzero(part(inside, corner, cells) != part(inside, corner + step, cells))
            share = (iso - a[crossed]) / (b[crossed] - a[crossed])
            sums[crossed] += np.array(corner) + share[:, None] * step
            counts[crossed] += 1
    number, at = np.full(cells, -1), np.nonzero(counts)
    number[at] = np.arange(len(at[0]))
    vertices = np.stack(at, axis=-1) + sums[at] / counts[at][:, None]

    quads = []
    for axis in range(3):
        step, u, v = (np.eye(3, dtype=int)[(axis + k) % 3] for k in range(3))
        # The edges along the axis that have four cells round them: the first sample of such an edge is not at the border of the two other axes.
        first, size = u + v, cells - (u + v)
        here, next_one = part(inside, first, size), part(inside, first + step, size)
        edges = np.stack(np.nonzero(here != next_one), axis=-1) + first
        round_it = np.stack([number[tuple((edges - back).T)] for back in (u + v, v, 0 * u, u)], axis=-1)
        outwards = inside[tuple(edges.T)]
        quads.append(np.where(outwards[:, None], round_it, round_it[:, ::-1]))
    return vertices, np.concatenate(quads)


def add_wall(frames, motion, iso, *, times, cyclic=False, fps=None, name="wall"):
    """Adds the wall as an object to the scene, and returns it. frames: palpate.Frames or a list of volumes; motion: of all of them; times: s, one per
    frame. fps: Blender's frames per second; None: the scene's. ValueError if no part of the reference frame has the value."""
    scene = bpy.context.scene
    if fps is not None:
        scene.render.fps = fps
    reference = motion.reference or 0
    index, quads = surface(frames[reference], iso)
    if len(quads) == 0:
        raise ValueError(f"the value {iso:g} is nowhere between two samples of the reference frame: choose another one")
    if np.linalg.det(motion.direction) < 0.0:
        quads = quads[:, ::-1]
    start_mm = np.array(motion.origin) + (index * motion.spacing) @ motion.direction.T

    def at_frame(k):
        if motion.is_whole:
            return motion.move_points(start_mm, time_s=times[k])
        return motion.move_points(start_mm, 0) if k == 1 else start_mm

    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata((0.001 * start_mm).tolist(), [], quads.tolist())
    mesh.polygons.foreach_set("use_smooth", np.ones(len(quads), dtype=bool))
    wall = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(wall)
    wall["verdict"] = motion.verdict.trust

    # Of the keys two neighbours have values at a time, which add up to 1: the mesh goes straight from one to the next.
    keyed = list(times)
    if cyclic:
        keyed.append(times[-1] + float(np.median(np.diff(times))))
    at = [1.0 + scene.render.fps * (time - times[0]) for time in keyed]
    wall.shape_key_add(name="Basis")
    for k in range(len(times)):
        key = wall.shape_key_add(name=f"{times[k]:.3f} s")
        key.data.foreach_set("co", (0.001 * at_frame(k)).astype(np.float32).reshape(-1))
        for j, frame in enumerate(at):
            key.value = float(j % len(times) == k)
            key.keyframe_insert("value", frame=frame)
    for curve in mesh.shape_keys.animation_data.action.fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    # The frame at the end of a cycle is its first one again.
    scene.frame_start, scene.frame_end = 1, max(1, int(np.ceil(at[-1])) - int(cyclic))
    return wall


def main(arguments):
    parser = argparse.ArgumentParser(prog="palpate_wall.py", description=__doc__.splitlines()[0])
    parser.add_argument("sequence", nargs="+", help="what palpate opens: a folder, a 4D file, or files of frames in order")
    parser.add_argument("--iso-value", type=float, required=True, help="the value on the wall")
    parser.add_argument("--motion", help="a file that palpate motion wrote (sequence_motion.nrrd); without it the motion is estimated")
    parser.add_argument("--preset", default="balanced", choices=palpate.PRESETS, help="the effort of the estimation")
    parser.add_argument("--cyclic", action="store_true", help="the last frame leads back to the first")
    parser.add_argument("--fps", type=int, help="Blender's frames per second")
    parser.add_argument("-o", "--output", required=True, help="the file to write, .blend")
    given = parser.parse_args(arguments)
    try:
        frames = palpate.open_sequence(given.sequence)
        # Frames without times are played in one second, as the program does it.
        times = frames.times if frames.has_times else [k / len(frames) for k in range(len(frames))]
        if given.motion:
            motion = palpate.open_motion(given.motion)
        else:
            motion = palpate.register(frames, times=times, preset=given.preset, cyclic=given.cyclic)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        wall = add_wall(frames, motion, given.iso_value, times=times, cyclic=given.cyclic, fps=given.fps)
        bpy.ops.wm.save_as_mainfile(filepath=given.output)
    except (ValueError, OSError, RuntimeError, MemoryError) as error:
        print(f"palpate: {error}", file=sys.stderr)
        sys.exit(2)
    print(f"Wrote     {given.output}: {len(wall.data.vertices)} vertices, {len(times)} shape keys{', ' + motion.verdict.trust if motion.verdict.trust else ''}")


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
