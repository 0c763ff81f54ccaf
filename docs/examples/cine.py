#!/usr/bin/env python3
"""How a beating heart moves, from the frames of a cine scan, and how well its motion explains them.

    python3 cine.py frame_*.mha --frames-per-second 33.3 --save motion.nrrd

Frames are 3D MetaImages, or any files that nibabel reads (.nii.gz). The result is one motion for the whole cycle; its reference frame is the one
nearest to the mean of all frames. The file of the motion can be felt: palpate feel frame_*.mha --fields motion.nrrd
"""

import argparse
import sys
import time
import zlib

import numpy as np

import palpate


def read_metaimage(path):
    """A 3D MetaImage in one file: array (z, y, x), spacing, origin, direction."""
    with open(path, "rb") as file:
        header = {}
        while "ElementDataFile" not in header:
            key, _, value = file.readline().decode("ascii").partition("=")
            header[key.strip()] = value.strip()
        data = file.read()
    if header.get("CompressedData", "False") == "True":
        data = zlib.decompress(data)
    types = {"MET_SHORT": "<i2", "MET_USHORT": "<u2", "MET_UCHAR": "u1", "MET_FLOAT": "<f4", "MET_DOUBLE": "<f8"}
    size = [int(n) for n in header["DimSize"].split()]
    array = np.frombuffer(data, types[header["ElementType"]]).reshape(size[::-1])
    spacing = [float(n) for n in header["ElementSpacing"].split()]
    origin = [float(n) for n in header.get("Offset", "0 0 0").split()]
    # TransformMatrix has the directions of the axes one after the other: the columns of the direction matrix.
    direction = np.reshape([float(n) for n in header.get("TransformMatrix", "1 0 0 0 1 0 0 0 1").split()], (3, 3)).T
    return array, spacing, origin, direction


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("frames", nargs="+", help="frames of one cycle, in order")
    parser.add_argument("--frames-per-second", type=float, default=1.0)
    parser.add_argument("--preset", choices=palpate.PRESETS, default="balanced")
    parser.add_argument("--save", metavar="FILE.nrrd", help="write the motion for palpate")
    arguments = parser.parse_args()

    geometry = {}
    if all(path.endswith(".mha") for path in arguments.frames):
        read = [read_metaimage(path) for path in arguments.frames]
        frames = [frame for frame, *_ in read]
        geometry = dict(zip(("spacing", "origin", "direction"), read[0][1:]))
    else:
        import nibabel

        frames = [nibabel.load(path) for path in arguments.frames]
    times = [k / arguments.frames_per_second for k in range(len(frames))]

    def progress(doing, share):
        print(f"\r{100 * share:3.0f} %  {doing:40}", end="", file=sys.stderr)

    begin = time.monotonic()
    motion = palpate.register(frames, times=times, cyclic=True, preset=arguments.preset, progress=progress, **geometry)
    print(f"\r{motion!r}, {time.monotonic() - begin:.1f} s{'':30}", file=sys.stderr)

    # Each frame, warped onto the reference frame.
    print("frame    s     moves mm: mean   most   difference to the reference frame: as it is, carried back")
    volumes = [np.asarray(frame.dataobj).T if hasattr(frame, "dataobj") else frame for frame in frames]
    reference = volumes[motion.reference].astype(np.float32)
    for k, volume in enumerate(volumes):
        length = np.linalg.norm(motion.at(times[k]), axis=-1)
        carried = motion.warp(volume, time_s=times[k])
        print(f"{k:5}  {times[k]:5.2f}  {length.mean():16.2f} {length.max():6.2f}   "
              f"{np.abs(volume - reference).mean():34.1f}, {np.abs(carried - reference).mean():.1f}")
    print(f"verdict: {motion.verdict.trust}")
    for reason in motion.verdict.reasons:
        print(f"  {reason}")
    if arguments.save:
        motion.save(arguments.save)
    return 0 if motion.verdict else 1


if __name__ == "__main__":
    sys.exit(main())
