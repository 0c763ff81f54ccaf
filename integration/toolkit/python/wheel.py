#!/usr/bin/python3
"""Makes a Python wheel of a build: wheel.py BUILD FOLDER [--module FILE]...

The wheel has the module, the C library with its header, the program, and the shared libraries that these need, with their licences (Debian's copyright
files). Outside of it are the C and C++ runtimes and the Vulkan loader. Libraries of the window system are in a folder of their own, which is used only
where the system has none (__main__.py). The others keep their names: patchelf 0.14 leaves a renamed library's symbol versions behind, and the
program does not start. --module: the module built for a Python, in place of that of BUILD; several may be given. Needs patchelf, objdump, strip and dpkg. Writes FOLDER/*.whl
and prints its path.
"""

import argparse
import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

SOURCE = Path(__file__).resolve().parent
# What every Linux of the wheel's tag has (PEP 600), and the Vulkan loader, which must find the drivers of its own system.
SYSTEM = re.compile(r"(ld-linux-x86-64|libc|libm|libdl|libpthread|librt|libresolv|libutil|libstdc\+\+|libgcc_s|libvulkan)\.so\b")
# A system's drivers load the system's own: the wheel's are for systems without any.
WINDOWS = re.compile(r"(libGL|libGLX|libGLdispatch|libX11|libXext|libXrender|libxcb|libxcb-shm|libxcb-render|libXau|libXdmcp)\.so\b")


# Debian has several libraries under the names of BLAS and LAPACK, which OpenCV needs. The reference ones, where they are installed, make a wheel of
# 29 MB, OpenBLAS one of 40 MB.
REFERENCE = ":".join(str(folder) for name in ("lapack", "blas") for folder in sorted(Path("/usr/lib").glob(f"*-linux-gnu/{name}")))


def run(*command, **environment):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True, env={**os.environ, **environment}).stdout


def needed(file):
    return re.findall(r"NEEDED\s+(\S+)", run("objdump", "-p", file))


def libraries_of(files):
    """All shared libraries that files need, SYSTEM's left out: name -> file of this system."""
    found = {}
    for file in files:
        for name, path in re.findall(r"(\S+) => (/\S+)", run("ldd", file, LD_LIBRARY_PATH=REFERENCE)):
            if not SYSTEM.match(name) and not name.startswith("libpalpate"):
                found[name] = Path(path).resolve()
    # ldd also lists what SYSTEM's libraries need.
    reached, left = set(), list(files)
    while left:
        for name in needed(left.pop()):
            if name in found and name not in reached:
                reached.add(name)
                left.append(found[name])
    return {name: found[name] for name in sorted(reached)}


def licence_of(file):
    """The name of a library's package, and its copyright file."""
    for path in (file, str(file).replace("/usr/lib/", "/lib/", 1)):
        owner = subprocess.run(["dpkg", "-S", str(path)], capture_output=True, text=True).stdout
        if owner:
            package = owner.split(":")[0].split(",")[0]
            return package, Path(f"/usr/share/doc/{package}/copyright")
    raise SystemExit(f"no package of this system owns {file}: its licence is not known")


def stage(build, modules, root):
    package = root / "palpate"
    library, fallback = package / "lib", package / "lib/window"
    for folder in (fallback, package / "bin", package / "include"):
        folder.mkdir(parents=True)
    for file in [*SOURCE.glob("palpate/*.py"), *SOURCE.glob("palpate/*.pyi"), SOURCE / "palpate/py.typed"]:
        shutil.copy(file, package)
    shutil.copy(SOURCE.parent / "paraview/palpate_paraview.py", root)
    shutil.copy(SOURCE.parent / "palpate.h", package / "include")
    program, c_library = package / "bin/palpate", library / "libpalpate.so.0"
    shutil.copy(build / "palpate", program)
    shutil.copy((build / "libpalpate.so.0").resolve(), c_library)
    own = [program, c_library]
    for module in modules:
        own.append(Path(shutil.copy(module, package)))
    others = libraries_of([build / "palpate", build / "libpalpate.so.0"])
    for name, file in others.items():
        own.append(Path(shutil.copy(file, (fallback if WINDOWS.match(name) else library) / name)))
    for file in own:
        file.chmod(0o755)
        run("strip", "--strip-unneeded", file)
        up = {package: "$ORIGIN/lib", package / "bin": "$ORIGIN/../lib", library: "$ORIGIN", fallback: "$ORIGIN"}[file.parent]
        run("patchelf", "--force-rpath", "--set-rpath", up, file)
    return own, others


def glibc_of(files):
    """The newest version of glibc that the symbols of files ask for: (2, minor)."""
    versions = re.findall(r"GLIBC_(\d+)\.(\d+)", "".join(run("objdump", "-T", file) for file in files))
    return max((int(major), int(minor)) for major, minor in versions)


def write(root, target):
    lines = []
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as wheel:
        def add(name, data, mode):
            entry = zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0))
            entry.external_attr = (0o100000 | mode) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            wheel.writestr(entry, data)

        files = sorted(path for path in root.rglob("*") if path.is_file())
        record = next(path for path in root.iterdir() if path.name.endswith(".dist-info")).name + "/RECORD"
        for path in files:
            name, data = path.relative_to(root).as_posix(), path.read_bytes()
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            lines.append(f"{name},sha256={digest},{len(data)}\n")
            add(name, data, 0o755 if os.access(path, os.X_OK) and path.suffix not in (".py", ".txt") else 0o644)
        add(record, "".join(lines) + f"{record},,\n", 0o644)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--module", type=Path, action="append", default=[])
    given = parser.parse_args()
    modules = given.module or sorted((given.build / "python/palpate").glob("_palpate.cpython-*.so"))
    if not modules:
        raise SystemExit(f"{given.build} has no Python module: build the target palpate_python")
    pythons = sorted({"cp" + re.search(r"cpython-(\d+)", module.name)[1] for module in modules})
    version = run(given.build / "palpate", "--version").split()[1]
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        own, others = stage(given.build, modules, root)
        info = root / f"palpate-{version}.dist-info"
        (info / "licenses").mkdir(parents=True)
        shutil.copy(SOURCE.parents[2] / "cmake/copyright", info / "licenses/palpate.txt")
        for file in others.values():
            name, licence = licence_of(file)
            shutil.copy(licence, info / f"licenses/{name}.txt")
        # The C++ runtime is that of Debian 12, whose glibc is 2.36; no symbol shows what else of it is needed.
        platform = "manylinux_2_%d_x86_64" % max(36, glibc_of(own)[1])
        tag = ".".join(pythons)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: palpate\nVersion: {version}\nSummary: Motion fields, forces and pictures of moving "
                                       "volumes\nRequires-Python: >=3.11\nRequires-Dist: numpy\n")
        tags = "".join(f"Tag: {python}-{python}-{platform}\n" for python in pythons)
        (info / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: palpate\nRoot-Is-Purelib: false\n{tags}")
        # Not an entry point, which would import the package, and numpy with it. pip puts the Python's path into the first line.
        scripts = root / f"palpate-{version}.data/scripts"
        scripts.mkdir(parents=True)
        (scripts / "palpate").write_text('#!python\nimport importlib.util, runpy\nfolder = importlib.util.find_spec("palpate").'
                                         'submodule_search_locations[0]\nrunpy.run_path(folder + "/__main__.py", run_name="__main__")\n')
        (scripts / "palpate").chmod(0o755)
        given.folder.mkdir(parents=True, exist_ok=True)
        target = given.folder / f"palpate-{version}-{tag}-{tag}-{platform}.whl"
        write(root, target)
    print(target)


if __name__ == "__main__":
    sys.exit(main())
