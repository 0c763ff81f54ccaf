#!/usr/bin/env bash
# Makes a folder with what of Slurm and MUNGE this machine lacks, from its own Debian sources and without privileges: apt
# downloads with folders of its own, dpkg-deb unpacks, nothing is installed and no service starts.
# Cached. Prints the folder; says why and exits with 77 where it can not be made.
# usage: slurm_root.sh
# environment: PALPATE_SLURM_ROOT (where to).
set -euo pipefail

skip() {
  echo "SKIPPED: $*" >&2
  exit 77
}
root=${PALPATE_SLURM_ROOT:-${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/palpate/slurm}
for tool in apt-get dpkg-deb flock; do
  command -v "$tool" >/dev/null || skip "$tool is needed to fetch Slurm."
done
mkdir -p "$(dirname "$root")" 2>/dev/null || skip "$(dirname "$root") can not be written."
exec 9>"$root.lock"
flock 9
if [[ ! -e $root/complete ]]; then
  work=$root.making
  rm -rf "$work" "$root"
  mkdir -p "$work"/{archives/partial,tree}
  # What is installed is not fetched again.
  apt-get -q -y --download-only -o Debug::NoLocking=true -o Dir::Cache="$work" -o Dir::Cache::archives="$work/archives" \
    -o APT::Sandbox::User="$(id -un)" -o APT::Install-Recommends=false -o Acquire::Retries=2 -o Acquire::http::Timeout=15 \
    install slurmctld slurmd slurm-client munge >"$work/log" 2>&1 ||
    skip "Slurm's packages can not be fetched: $(grep -m1 '^E' "$work/log")"
  for package in "$work"/archives/*.deb; do
    [[ -e $package ]] || continue
    dpkg-deb --fsys-tarfile "$package" | tar -x -C "$work/tree" --keep-directory-symlink --no-same-owner 9>&-
  done
  # Installing would give the programs their names, as alternatives.
  for program in "$work"/tree/usr/*bin/*-wlm; do
    [[ ! -e $program || -e ${program%-wlm} ]] || ln -s "$(basename "$program")" "${program%-wlm}"
  done
  touch "$work/tree/complete"
  mv "$work/tree" "$root"
  rm -rf "$work"
fi
echo "$root"
