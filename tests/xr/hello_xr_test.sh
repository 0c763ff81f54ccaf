#!/usr/bin/env bash
# Debian's own hello_xr must run on the tests' OpenXR runtime, so that the runtime does not only match palpate's own module.
# usage: hello_xr_test.sh MANIFEST
set -euo pipefail
if ! command -v hello_xr >/dev/null; then
  echo "SKIPPED: hello_xr is not installed (Debian: libopenxr-utils)."
  exit 77
fi
folder=$(mktemp -d)
# It ends at the first key or the end of its input, so it gets a pipe that stays open without input.
mkfifo "$folder/keys"
export XR_RUNTIME_JSON=$1 PALPATE_FAKE_XR_FRAMES=60 PALPATE_FAKE_XR_REPORT=$folder/report
# At its end it waits for the thread that reads its input, from glibc 2.41 on: it gets a key when the session is over.
{ until grep -qs -- "->XR_SESSION_STATE_EXITING" "$folder/log"; do sleep 0.1; done; echo >"$folder/keys"; } &
trap 'kill $! 2>/dev/null || true; rm -rf "$folder"' EXIT
rc=0
timeout 120 hello_xr -g Vulkan2 0<>"$folder/keys" >"$folder/log" 2>&1 || rc=$?
if [[ $rc != 0 ]]; then
  cat "$folder/log"
  echo "hello_xr ended with $rc."
  exit 1
fi
cat "$folder/report"
grep -qx "frames 60" "$folder/report"
grep -qx "violations 0" "$folder/report"
# The session went through all states, up and down.
for state in READY SYNCHRONIZED VISIBLE FOCUSED STOPPING IDLE EXITING; do
  grep -q -- "->XR_SESSION_STATE_$state" "$folder/log"
done
! grep -qi "validation error" "$folder/log"
