#!/usr/bin/env bash
# Builds and runs the six examples in a fresh Debian with palpate's packages only, then removes the packages.
# usage: fresh_root.sh ROOT DATA [PACKAGES [SUITE]]
#   ROOT      a folder that debootstrap fills (about 4 GB); if it is a Debian already, it is used as it is
#   DATA      a folder with heart_cine/frame_*.mha, a beating heart, and lung/pair_*.mha, a pair in known motion
#   PACKAGES  the folder of palpate's packages: build, by default
#   SUITE     the Debian that they were made on: this machine's, by default (bookworm, trixie)
# Before it: cmake --build build && (cd build && cpack). As root, with the network; what it mounts goes when it ends.
set -euo pipefail
[[ $# -ge 2 ]] || { sed -n 2,8p "$0"; exit 2; }
# Mounts made by this script.
[[ ${PALPATE_UNSHARED:-} ]] || PALPATE_UNSHARED=1 exec unshare --mount --pid --fork "$0" "$@"
root=$1 data=$2 packages=${3:-build} suite=${4:-$(. /etc/os-release && echo "$VERSION_CODENAME")}

step() { echo "== $*"; }
inside() { chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive "$@"; }
# As a user without privileges, with a home of its own.
person() { chroot "$root" su -l person -c "$1"; }
palpate_files() { find "$root" -xdev -iname '*palpate*' -not -path "$root/packages*" -not -path "$root/home/*" -not -path "$root/tmp/*" -not -name palpate.log | sort; }

if [[ ! -e $root/etc/debian_version ]]; then
  step "A fresh Debian, $suite, in $root"
  debootstrap --variant=minbase --include=ca-certificates "$suite" "$root" http://deb.debian.org/debian >"$root.log"
  printf 'deb http://deb.debian.org/debian%s\n' " $suite main" " $suite-updates main" "-security $suite-security main" \
    >"$root/etc/apt/sources.list"
  cp /etc/resolv.conf "$root/etc/resolv.conf"
fi
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
mount --make-rslave "$root/dev"

step "Compilers, and the hosts' own libraries"
inside apt-get update -qq
# ITK's CMake files need FFTW, which its package only recommends; VTK's need MPI, and its examples' display needs xvfb.
inside apt-get install -y -qq --no-install-recommends \
  g++ cmake make pkg-config libinsighttoolkit5-dev libfftw3-dev libvtk9-dev \
  libglfw3-dev libglm-dev libvulkan-dev glslang-tools python3-numpy xvfb xauth mesa-vulkan-drivers >"$root/hosts.log" 2>&1 ||
  { tail -20 "$root/hosts.log"; exit 1; }
# Leftovers of a run that failed.
inside apt-get purge -y -qq '?name(palpate)' >>"$root/hosts.log" 2>&1
[[ -z $(palpate_files) ]] || { echo "palpate is there already:"; palpate_files; exit 1; }
inside id person >/dev/null 2>&1 || inside useradd --create-home person

step "palpate's packages"
rm -rf "$root/packages" "$root/home/person/"*
mkdir "$root/packages"
cp "$packages"/*.deb "$root/packages"
# All packages that cpack makes, so that each of them is installed and removed.
mapfile -t names < <(for file in "$root/packages/"*.deb; do dpkg-deb --field "$file" Package; done)
[[ $(printf '%s\n' "${names[@]}" | sort -u | wc -l) -eq ${#names[@]} ]] || { echo "A package is there in two versions: ${names[*]}"; exit 1; }
for name in palpate libpalpate0 libpalpate-dev python3-palpate palpate-lab palpate-cohort; do
  [[ " ${names[*]} " == *" $name "* ]] || { echo "$name is not in $packages"; exit 1; }
done
inside sh -c 'apt-get install -y -qq --no-install-recommends /packages/*.deb' >"$root/palpate.log" 2>&1 ||
  { cat "$root/palpate.log"; exit 1; }
inside dpkg-query -W -f '${Package} ${Version}: ${Depends}\n' "${names[@]}"
mkdir "$root/home/person/data"
cp "$data"/heart_cine/frame_*.mha "$data"/lung/pair_*.mha "$root/home/person/data"
inside chown -R person: /home/person

step "The examples are built"
# (ITK requires all of GDCM, whose CMake files list programs of a package that is not needed and print long messages about them.)
person 'cmake -S /usr/share/doc/libpalpate-dev/examples -B examples -DCMAKE_BUILD_TYPE=Release' >"$root/configured.log" 2>&1 ||
  { cat "$root/configured.log"; exit 1; }
grep 'left out' "$root/configured.log" || true
person 'cmake --build examples -j 2' | grep -E 'Built|warning|error'
for example in host_loop host_vulkan itk_demons vtk_volume libmy_mode.so; do
  [[ -e $root/home/person/examples/$example ]] || { echo "$example was not built"; exit 1; }
done

step "host_loop.c"
person 'cc -std=c99 -pedantic -Wall -Werror /usr/share/doc/libpalpate-dev/examples/host_loop.c $(pkg-config --cflags --libs palpate) -lm -o by_hand'
person './by_hand --seconds 4'
person 'examples/host_loop data/frame_*.mha --seconds 30'
step "host_vulkan.cpp"
person 'xvfb-run -a -s "-screen 0 1280x800x24" examples/host_vulkan --frames 3 --screenshot heart.ppm'
person 'xvfb-run -a -s "-screen 0 1280x800x24" examples/host_vulkan data/frame_00.mha --frames 3 --screenshot cine.ppm'
person 'ls -l heart.ppm cine.ppm'
step "itk_demons.cxx"
person 'examples/itk_demons data/pair_fixed.mha data/pair_moving.mha data/pair_truth.mha data/pair_body.mha --warped warped.mha --field field.mha'
person 'palpate check field.mha --truth data/pair_truth.mha --mask data/pair_body.mha' | grep -E 'Endpoint|Folds'
step "vtk_volume.cxx"
person 'examples/vtk_volume --cycle 0.6 moved.vti data/frame_*.mha'
step "cine.py"
person 'python3 /usr/share/doc/libpalpate-dev/examples/cine.py data/frame_*.mha --frames-per-second 33.3 --save motion.nrrd' 2>&1 |
  tr '\r' '\n' | tail -24
step "my_mode.c"
person 'palpate feel /usr/share/doc/libpalpate-dev/examples/my_mode.json --modes examples/libmy_mode.so --device simulated --headless pictures --seconds 4'

step "palpate's packages go"
inside apt-get purge -y -qq "${names[@]}" >>"$root/palpate.log" 2>&1
left=$(palpate_files)
[[ -z $left ]] || { echo "Files of palpate are left:"; echo "$left"; exit 1; }
echo "No file of palpate is left."
