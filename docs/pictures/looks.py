#!/usr/bin/python3
"""Draws docs/pictures/looks.png: the look that 'palpate view' chooses by itself for a volume of each anatomy of the tests' data.

usage: looks.py PALPATE DATA OUT.png, with python3-cairo
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import cairo

VOLUMES = ("lung/pair_fixed", "heart_cine/frame_00", "liver/19/fixed", "kit/chestct_breathing/fixed", "kit/thoraxmr_heart/fixed",
           "kit/headmr_waves/fixed", "kit/bodypet_affine/fixed", "kit/spineus_bspline/fixed", "kit/tooth_bspline/fixed")
EDGE, COLUMNS = 256, 3


def main() -> None:
    palpate, data, out = sys.argv[1:]
    rows = -(-len(VOLUMES) // COLUMNS)
    sheet = cairo.ImageSurface(cairo.FORMAT_RGB24, EDGE * COLUMNS, EDGE * rows)
    pen = cairo.Context(sheet)
    with tempfile.TemporaryDirectory() as folder:
        for n, volume in enumerate(VOLUMES):
            # Under a name that says nothing.
            picture = Path(folder) / f"{n}.png"
            subprocess.run([palpate, "view", str(Path(data) / f"{volume}.mha"), "--picture", str(picture), "--no-slices", "--picture-size", str(2 * EDGE),
                            "--quiet"], check=True)
            pen.save()
            pen.translate(n % COLUMNS * EDGE, n // COLUMNS * EDGE)
            pen.scale(0.5, 0.5)
            pen.set_source_surface(cairo.ImageSurface.create_from_png(str(picture)))
            pen.paint()
            pen.restore()
    sheet.write_to_png(out)


if __name__ == "__main__":
    main()
