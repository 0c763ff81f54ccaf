#!/usr/bin/env bash
# Makes one wheel for the Pythons of several Debians, installs it by pip in a fresh root of each, and compares: the first picture, and the field of a pair,
# which must be that of this machine within 0.02 voxel.
# usage: wheel_roots.sh BUILD ROOTS DATA [SUITE...]
#   BUILD  a build with palpate, libpalpate and the Python module
#   ROOTS  a folder for the roots, about 1 GB each; a root that is there is used as it is
#   DATA   a folder with lung/pair_fixed.mha and lung/pair_moving.mha
#   SUITE  bookworm trixie forky, if none is named
# As root, with the network; needs debootstrap, patchelf, g++. Exits with 77 where it can not run. The wheel stays in ROOTS/wheel.
set -euo pipefail
[[ $# -ge 3 ]] || { sed -n 2,10p "$0"; exit 2; }
# Mounts made by this script.
[[ ${PALPATE_UNSHARED:-} ]] || PALPATE_UNSHARED=1 exec unshare --mount --propagation private "$0" "$@"
source=$(cd "$(dirname "$0")/../.." && pwd)
build=$(realpath "$1") data=$(realpath "$3")
mkdir -p "$2"
roots=$(realpath "$2")
shift 3
suites=("$@")
(($#)) || suites=(bookworm trixie forky)
for tool in debootstrap patchelf g++; do
  command -v "$tool" >/dev/null || { echo "SKIPPED: $tool is needed."; exit 77; }
done
[[ -e $data/lung/pair_fixed.mha ]] || { echo "SKIPPED: $data/lung is not there."; exit 77; }

modules=()
for module in "$build"/python/palpate/_palpate.cpython-*.so; do modules+=(--module "$module"); done
for suite in "${suites[@]}"; do
  root=$roots/$suite
  if [[ ! -e $root/etc/debian_version ]]; then
    script=/usr/share/debootstrap/scripts/$suite
    [[ -e $script ]] || script=/usr/share/debootstrap/scripts/sid
    debootstrap --variant=minbase --include=python3-venv,python3-numpy,libpython3-dev,pybind11-dev,libvulkan1,mesa-vulkan-drivers \
      "$suite" "$root" http://deb.debian.org/debian "$script" >"$root.log" || { echo "SKIPPED: $suite can not be fetched ($root.log)."; exit 77; }
  fi
  # The module for the root's Python, with its headers and this machine's compiler, so that it needs no newer glibc.
  python=$(basename "$(readlink "$root/usr/bin/python3")")
  module=_palpate.cpython-3${python#python3.}-x86_64-linux-gnu.so
  if [[ ! -e $build/python/palpate/$module && " ${modules[*]} " != *"/$module "* ]]; then
    headers=$(mktemp -d)
    cp -r "$root/usr/include/$python" "$root/usr/include/pybind11" "$headers"
    mkdir "$headers/x86_64-linux-gnu"
    cp -r "$root/usr/include/x86_64-linux-gnu/$python" "$headers/x86_64-linux-gnu"
    mkdir -p "$roots/modules"
    g++ -std=c++20 -O2 -DNDEBUG -fPIC -shared -fvisibility=hidden -I"$source" -I"$source/integration/toolkit" -I"$headers" -I"$headers/$python" \
      -o "$roots/modules/$module" "$source/integration/toolkit/python/binding.cpp" "$build/libpalpate.so.0"
    rm -r "$headers"
    modules+=(--module "$roots/modules/$module")
  fi
done
rm -rf "$roots/wheel"
wheel=$(/usr/bin/python3 "$source/integration/toolkit/python/wheel.py" "$build" "$roots/wheel" "${modules[@]}")
echo "$(basename "$wheel"), $(stat -c %s "$wheel") bytes"

cat >"$roots/estimate.py" <<'PYTHON'
import sys
import zlib

import numpy as np
import palpate


def read(path):
    head, _, samples = open(path, "rb").read().partition(b"ElementDataFile = LOCAL\n")
    keys = dict(line.split(" = ", 1) for line in head.decode().splitlines())
    samples = zlib.decompress(samples) if keys.get("CompressedData") == "True" else samples
    shape = [int(n) for n in reversed(keys["DimSize"].split())]
    return np.frombuffer(samples, "<i2").reshape(shape), [float(s) for s in keys["ElementSpacing"].split()]


(fixed, spacing), (moving, _) = (read(f"{sys.argv[1]}/pair_{name}.mha") for name in ("fixed", "moving"))
np.save(sys.argv[2], palpate.register(fixed, moving, spacing=spacing, preset="fast", verdict=False).field)
PYTHON
failed=0
PYTHONPATH=$build/python /usr/bin/python3 "$roots/estimate.py" "$data/lung" "$roots/here.npy"
for suite in "${suites[@]}"; do
  root=$roots/$suite
  rm -rf "$root/wheel"
  mkdir -p "$root/wheel/lung"
  cp "$wheel" "$roots/estimate.py" "$root/wheel"
  cp "$data"/lung/pair_{fixed,moving}.mha "$root/wheel/lung"
  mount -t proc proc "$root/proc"
  mount --rbind /dev "$root/dev"
  mount --make-rslave "$root/dev"
  begin=$(date +%s)
  # As a user without privileges.
  chmod 777 "$root/wheel"
  chroot --userspec=1000:1000 "$root" env -i HOME=/wheel PATH=/usr/bin:/bin sh -e -c 'cd /wheel
    python3 -m venv --system-site-packages v && v/bin/pip install -q --no-index palpate-*.whl
    v/bin/palpate view lung/pair_fixed.mha --picture first.png >log && test -s first.png && v/bin/python -m palpate --version >log'
  picture=$(date +%s)
  chroot --userspec=1000:1000 "$root" env -i HOME=/wheel PATH=/usr/bin:/bin sh -c 'cd /wheel && v/bin/python estimate.py lung field.npy'
  umount -R "$root/dev" "$root/proc"
  /usr/bin/python3 - "$suite" $((picture - begin)) "$roots/here.npy" "$root/wheel/field.npy" <<'PYTHON' || failed=$((failed + 1))
import sys
import numpy as np
here, there = (np.load(path) for path in sys.argv[3:])
apart = np.linalg.norm(here - there, axis=-1) / 1.366
print(f"{sys.argv[1]}: first picture {sys.argv[2]} s after pip was started; the fields differ by {apart.max():.4f} voxel at most (limit 0.02), "
      f"by {apart.mean():.4f} on average, by more than 0.02 at {100 * (apart > 0.02).mean():.2f} % of the voxels")
sys.exit(not apart.max() <= 0.02)
PYTHON
done
echo "$((${#suites[@]} - failed)) of ${#suites[@]} roots passed"
((failed == 0))
