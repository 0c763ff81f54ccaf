#!/usr/bin/env bash
# Makes a folder with packages of another Debian release and all that they need, without privileges: apt downloads with folders of its own, dpkg-deb
# unpacks, nothing is installed. The programs in it run with the folder's own ld.so. Cached: a second call is fast. Prints the folder; prints the reason
# and exits with 77 if it can not be made.
# usage: foreign_root.sh FOLDER RELEASE PROGRAM PACKAGE...; PROGRAM is a path in the folder that must be there.
# environment: PALPATE_DEBIAN_MIRROR (default http://deb.debian.org/debian).
set -euo pipefail

skip() {
  echo "SKIPPED: $*" >&2
  exit 77
}
root=$1 release=$2 program=$3
shift 3
[[ $(uname -m) == x86_64 ]] || skip "A root of Debian $release is only made on x86_64."
if [[ -e $root/complete ]]; then
  echo "$root"
  exit 0
fi
for tool in apt-get dpkg-deb flock; do
  command -v "$tool" >/dev/null || skip "$tool is needed to fetch $program from Debian $release."
done
keys=/usr/share/keyrings/debian-archive-keyring.gpg
[[ -r $keys ]] || skip "Debian's keys are not there: install debian-archive-keyring."
mkdir -p "$(dirname "$root")" 2>/dev/null || skip "$(dirname "$root") can not be written."

# Tests may run at the same time: one makes the folder, the others wait.
exec 9>"$root.lock"
flock 9
if [[ -e $root/complete ]]; then
  echo "$root"
  exit 0
fi
work=$root.making
rm -rf "$work" "$root"
mkdir -p "$work"/{state/lists/partial,cache/archives/partial,etc,tree}
: >"$work/status"
echo "deb [signed-by=$keys] ${PALPATE_DEBIAN_MIRROR:-http://deb.debian.org/debian} $release main" >"$work/etc/sources.list"
# The machine's own apt settings (a proxy) stay in force; its sources, state and packages do not.
apt=(apt-get -q -o "Dir::State=$work/state" -o "Dir::State::status=$work/status" -o "Dir::Cache=$work/cache"
  -o "Dir::Etc::sourcelist=$work/etc/sources.list" -o Dir::Etc::sourceparts=/dev/null -o Dir::Etc::preferencesparts=/dev/null
  -o APT::Architecture=amd64 -o APT::Architectures=amd64 -o APT::Sandbox::User="$(id -un)" -o APT::Install-Recommends=false
  -o Acquire::Languages=none -o Acquire::Retries=2 -o Acquire::http::Timeout=15 -o Debug::NoLocking=true)
"${apt[@]}" update >"$work/log" 2>&1 || skip "Debian $release can not be reached: $(grep -m1 -E '^(E|W|Err)' "$work/log")"
"${apt[@]}" -y --download-only install "$@" >>"$work/log" 2>&1 || skip "$* can not be fetched: $(grep -m1 '^E' "$work/log")"
for package in "$work"/cache/archives/*.deb; do
  # dpkg-deb keeps existing files: /bin is a folder in some packages and a link in others.
  dpkg-deb --fsys-tarfile "$package" | tar -x -C "$work/tree" --keep-directory-symlink --no-same-owner 9>&-
done
[[ -x $work/tree/$program ]] || skip "The packages $* hold no $program."
# The manifest with which a loader finds the driver, with an absolute path.
printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "%s", "api_version": "1.4.0"}}\n' \
  "$root/usr/lib/x86_64-linux-gnu/libvulkan_lvp.so" >"$work/tree/lavapipe.json"
touch "$work/tree/complete"
mv "$work/tree" "$root"
rm -rf "$work"
echo "$root"
