#!/usr/bin/env bash
# Makes a folder with what of Slurm and MUNGE, of Snakemake, of ParaView, or of Blender, this machine lacks, from its own
# Debian sources and without privileges: apt downloads with folders of its own, dpkg-deb unpacks, nothing is installed and no
# service starts.
# Cached. Prints the folder; says why and exits with 77 where it can not be made.
# usage: debian_root.sh slurm|snakemake|paraview|blender
# environment: PALPATE_SLURM_ROOT, PALPATE_SNAKEMAKE_ROOT, PALPATE_PARAVIEW_ROOT, PALPATE_BLENDER_ROOT (where to).
set -euo pipefail

skip() {
  echo "SKIPPED: $*" >&2
  exit 77
}
root=${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/palpate/$1
# What to fetch, what the test starts, and packages without which that runs.
case "$1" in
  slurm)
    root=${PALPATE_SLURM_ROOT:-$root}
    wanted=(slurmctld slurmd slurm-client munge)
    programs=(munged slurmctld slurmd sinfo sbatch)
    without='^$'
    ;;
  snakemake)
    root=${PALPATE_SNAKEMAKE_ROOT:-$root}
    wanted=(snakemake)
    programs=(snakemake)
    # Clients of clouds, 640 of 660 MB: smart-open does without them.
    without='^python3-(azure|azure-storage|uamqp|msrest|msrestazure|msal|msal-extensions|adal|boto3|botocore|s3transfer)='
    ;;
  paraview)
    # Installed, python3-paraview would remove python3-vtk9 and with it libvtk9-dev, which the filters for VTK need.
    root=${PALPATE_PARAVIEW_ROOT:-$root}
    wanted=(paraview python3-paraview)
    programs=(pvpython)
    # Plots and the web server: pvpython does without them.
    without='^(python3-([^p]|p[^a])|python-matplotlib|fonts-|blt|cython3|tk|unicode-data)'
    ;;
  blender)
    root=${PALPATE_BLENDER_ROOT:-$root}
    wanted=(blender)
    programs=(blender)
    without='^fonts-'
    ;;
esac
for tool in apt-get dpkg-deb flock; do
  command -v "$tool" >/dev/null || skip "$tool is needed to fetch $1."
done
# A folder in which one of these is missing, and the machine has none either, is of no use.
needed() {
  local program
  for program in "${programs[@]}"; do
    PATH=$root/usr/sbin:$root/usr/bin:$PATH:/usr/sbin:/sbin command -v "$program" >/dev/null || { echo "$program"; return; }
  done
}

mkdir -p "$(dirname "$root")" 2>/dev/null || skip "$(dirname "$root") can not be written."
exec 9>"$root.lock"
flock 9
if [[ ! -e $root/complete || -n $(needed) ]]; then
  work=$root.making
  rm -rf "$work" "$root"
  mkdir -p "$work"/{archives,tree}
  # What is installed is not fetched again. The packages are fetched one by one into this folder: "install --download-only"
  # leaves them where they are when the source is a folder.
  apt-get -s -o Debug::NoLocking=true -o APT::Install-Recommends=false install "${wanted[@]}" >"$work/plan" 2>"$work/log" ||
    skip "The packages of $1 are not to be had: $(grep -m1 '^E' "$work/log")"
  mapfile -t packages < <(sed -nE 's/^Inst ([^ ]+) (\[[^]]*\] )?\(([^ ]+) .*/\1=\3/p' "$work/plan" | grep -vE "$without")
  if ((${#packages[@]})); then
    (cd "$work/archives" && apt-get -q -o APT::Sandbox::User="$(id -un)" -o Acquire::Retries=2 -o Acquire::http::Timeout=15 \
      download "${packages[@]}") >"$work/log" 2>&1 || skip "The packages of $1 can not be fetched: $(grep -m1 '^E' "$work/log")"
  fi
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
  missing=$(needed)
  [[ -z $missing ]] || skip "$missing is in none of the packages that were fetched (${packages[*]:-none: apt takes them for installed})."
fi
echo "$root"
