#!/usr/bin/env python3
"""palpate info on real files of other programs, as Debian's packages install them: what each holds, or why it is refused.

usage: real_files_test.py PALPATE PACKAGE      PACKAGE: one of PACKAGES
Exit status 77: the package is not installed, and that is said.
"""

import json
import subprocess
import sys
from pathlib import Path

PYTHON = Path("/usr/lib/python3/dist-packages")
# The folder of each package's files.
PACKAGES = {
    "python3-nibabel": PYTHON / "nibabel",
    "python3-pydicom": PYTHON / "pydicom/data/test_files",
    "insighttoolkit5-examples": Path("/usr/share/doc/insighttoolkit5-examples/examples/Data"),
}

MINC = "in no format that palpate knows"
UNPACK = "unpack it with gunzip"
SLICE = "is a single DICOM slice"
COLOUR = "is a colour picture"
NOWHERE = "does not say where its slice lies"

# What a file is ("kind", size, spacing in mm, frames), or a part of the sentence that refuses it.
WANTED = {
    "python3-nibabel": {
        "tests/data/anatomical.nii": ("volume", (33, 41, 25), (2, 2, 2), 1),
        "tests/data/functional.nii": ("sequence", (17, 21, 3), (4, 4, 8), 20),
        "tests/data/reoriented_anat_moved.nii": ("volume", (21, 26, 22), (4, 4, 4), 1),
        "tests/data/resampled_anat_moved.nii": ("volume", (17, 21, 3), (4, 4, 8), 1),
        "tests/data/example4d.nii.gz": ("sequence", (128, 96, 24), (2, 2, 2.2), 2),
        "tests/data/example_nifti2.nii.gz": ("sequence", (32, 20, 12), (2, 2, 2.2), 2),
        "tests/data/standard.nii.gz": ("mask", (4, 5, 7), (1, 3, 2), 1),
        "tests/data/row_major.dconn.nii": "is a CIFTI file",
        "tests/data/analyze.hdr": "save Analyze as NIfTI",
        "tests/data/nifti1.hdr": "nifti1.img', which can not be read",
        "tests/data/nifti2.hdr": "nifti2.img', which can not be read",
        "tests/data/test.mgz": UNPACK,
        "tests/data/minc1_4d.mnc": MINC,
        "tests/data/minc2_4d.mnc": MINC,
        "tests/data/small.mnc": MINC,
        "tests/data/example4d+orig.HEAD": MINC,
        "tests/data/simple.trk": MINC,
        "tests/data/phantom_EPI_asc_CLEAR_2_1.PAR": MINC,
        **dict.fromkeys(("nicom/tests/data/0.dcm", "nicom/tests/data/1.dcm"), "is a mosaic of 48 slices that do not fit its 256 x 256 pixels"),
        "nicom/tests/data/decimal_rescale.dcm": SLICE,
        "nicom/tests/data/slicethickness_empty_string.dcm": SLICE,
    },
    "python3-pydicom": {
        **dict.fromkeys(("693_J2KI.dcm", "CT_small.dcm", "J2K_pixelrep_mismatch.dcm", "MR_small.dcm", "MR_small_RLE.dcm",
                         "MR_small_bigendian.dcm", "MR_small_expb.dcm", "MR_small_implicit.dcm", "MR_small_jp2klossless.dcm",
                         "MR_small_jpeg_ls_lossless.dcm", "MR_small_padded.dcm"), SLICE),
        **dict.fromkeys(("ExplVR_BigEnd.dcm", "GDCMJ2K_TextGBR.dcm", "SC_jpeg_no_color_transform.dcm", "SC_rgb_dcmtk_+eb+cr.dcm",
                         "SC_rgb_gdcm_KY.dcm", "SC_rgb_jpeg_gdcm.dcm", "SC_rgb_rle.dcm", "SC_rgb_rle_16bit_2frame.dcm",
                         "SC_rgb_small_odd.dcm", "SC_ybr_full_422_uncompressed.dcm"), COLOUR),
        **dict.fromkeys(("JPEG-lossy.dcm", "JPEG2000.dcm", "JPGExtended.dcm", "image_dfl.dcm"), NOWHERE),
        **dict.fromkeys(("liver_1frame.dcm", "liver_expb_1frame.dcm"), "is a segmentation in DICOM's own form"),
        **dict.fromkeys(("badVR.dcm", "rtdose.dcm", "rtdose_1frame.dcm", "rtdose_rle.dcm", "rtdose_expb.dcm"), "is a dose distribution"),
        **dict.fromkeys(("reportsi.dcm", "test-SR.dcm"), "no image (modality SR)"),
        "MR_truncated.dcm": "is cut short within its pixels",
        "rtplan_truncated.dcm": "is cut short",
        "dicomdirtests/98892001/CT5N": ("volume", (16, 16, 5), (0.488, 0.488, 2.5), 1),
        "dicomdirtests/77654033/CT2": "unevenly spaced slices",
    },
    "insighttoolkit5-examples": {
        "BrainProtonDensity3Slices.mha": ("volume", (181, 217, 3), (1, 1, 1), 1),
        **dict.fromkeys(("RatLungSlice1.mha", "RatLungSlice2.mha"), ("volume", (128, 128, 1), (1, 1, 1), 1)),
        **dict.fromkeys(("CorpusCallosumMeanShape.mha", "CorpusCallosumMode0.mha", "CorpusCallosumMode1.mha", "CorpusCallosumMode2.mha"),
                        ("volume", (58, 31, 1), (2, 2, 2), 1)),
        **dict.fromkeys(("BrainProtonDensitySliceBorder20.mhd", "BrainProtonDensitySliceBorder20.nhdr",
                         "BrainProtonDensitySliceBorder20DirectionPlus30.mhd", "BrainProtonDensitySliceBorder20DirectionPlus30.nhdr",
                         "BrainProtonDensitySliceBorder20DirectionMinus30.mhd", "BrainProtonDensitySliceShifted13x17y.nhdr",
                         "BrainT1SliceBorder20DirectionPlus30.mhd", "BrainT1SliceBorder20DirectionPlus30.nhdr"),
                        ("volume", (221, 257, 1), (1, 1, 1), 1)),
        "itkBrainSliceComplexMagnitude.mha": ("volume", (181, 217, 1), (1, 1, 1), 1),
        "itkBrainSliceComplex.mha": ("components", (181, 217, 1), (1, 1, 1), 1),
        "BayesianClassifierInitializerMemberships.mhd": ("components", (181, 217, 1), (1, 1, 1), 1),
        "KmeansTest_T1UCharRaw.nii.gz": ("volume", (128, 128, 62), (2, 2, 3), 1),
        "KmeansTest_T1KmeansPrelimSegmentation.nii.gz": ("labels", (128, 128, 62), (2, 2, 3), 1),
        "KmeansTest_T1RawSkullStrip.nii.gz": ("labels", (128, 128, 62), (2, 2, 3), 1),
    },
}


def told(palpate: str, files: list[Path]) -> list[dict]:
    """What `palpate info` says of each file, in one run."""
    run = subprocess.run([palpate, "info", "--json", *map(str, files)], capture_output=True, text=True, check=False)
    assert run.returncode in (0, 2), f"exit status {run.returncode}: {run.stderr}"
    found = json.loads(run.stdout)["files"]
    assert len(found) == len(files), f"{len(found)} answers for {len(files)} files"
    return found


def difference(wanted, found: dict) -> str:
    """What is not as wanted, or an empty text."""
    if isinstance(wanted, str):
        return "" if wanted in found.get("error", "") else f"not refused with '{wanted}' but: {found.get('error', found.get('what'))}"
    if "error" in found:
        return f"refused: {found['error']}"
    kind, size, spacing, frames = wanted
    grid = found["grid"]
    got = (found["kind"], tuple(grid["size"]), tuple(round(s, 3) for s in grid["spacing_mm"]), found["frames"])
    return "" if got == (kind, size, tuple(float(s) for s in spacing), frames) else f"{got}, not {wanted}"


def main(palpate: str, package: str) -> int:
    folder, wanted = PACKAGES[package], WANTED[package]
    if not (folder / next(iter(wanted))).exists():
        print(f"SKIPPED: the files of {package} are not in {folder}")
        return 77
    paths = [folder / name for name in wanted]
    missing = [str(path) for path in paths if not path.exists()]
    assert not missing, f"{package} has no {missing}"
    wrong = [f"{name}: {difference(wanted[name], found)}" for name, found in zip(wanted, told(palpate, paths))
             if difference(wanted[name], found)]
    # All other files of the package's folders: anything but a crash, and a sentence for what is not read.
    folders = {path.parent for path in paths}
    others = [path for one in sorted(folders) for path in sorted(one.iterdir())
              if path.is_file() and path not in paths and path.suffix not in (".py", ".txt", ".json", ".rst", ".png")]
    for path, found in zip(others, told(palpate, others) if others else []):
        if "error" in found and str(path.name) not in found["error"]:
            wrong.append(f"{path}: its sentence does not name it: {found['error']}")
    print(f"{package}: {len(paths)} files as they should be read or refused, {len(others)} others without a crash")
    for line in wrong:
        print("WRONG", line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
