#!/usr/bin/env bash
# Which folder may include which: the rules that the build itself does not enforce.
# usage: arrows_test.sh SOURCE_DIR
set -euo pipefail
cd "$1"
failed=0

# only PATTERN ALLOWED FOLDER...: an include that matches PATTERN may stand only in files that match ALLOWED.
only() {
  local pattern=$1 allowed=$2
  shift 2
  local wrong
  wrong=$(grep -rlE "#include [<\"]($pattern)" --include='*.h' --include='*.cpp' "$@" | grep -vE "^($allowed)" || true)
  if [[ -n $wrong ]]; then
    echo "Only $allowed may include $pattern, but these do too:"
    echo "$wrong"
    failed=1
  fi
}

only 'vulkan/vulkan' 'compute/vulkan/|module/view/|module/xr/|integration/toolkit/dotnet/|tests/xr/|tests/view/|tests/toolkit/|docs/examples/' compute module integration tests
only 'openxr/' 'module/xr/|tests/xr/' compute module integration tests
only 'itk|gdcm' 'integration/files/|integration/toolkit/itk/|tests/files/|tests/toolkit/itk/|tests/lab/bench/peers/' compute module integration tests
only 'opencv2' 'integration/opencv/|tests/opencv/' compute module integration tests
only 'GLFW|GL/' 'integration/desktop/' compute module integration tests
only 'cairo' 'integration/charts/|tests/charts/|tests/lab/tests/report/browser_test' compute module integration tests
only 'alsa/' 'integration/sound/' compute module integration tests
only 'expat' 'integration/x3d/' compute module integration tests
only 'Eigen/' 'module/calibrate/' compute module integration
only 'CLI/' 'integration/app/|tests/lab/' compute module integration tests
only 'integration/' 'integration/|tests/' compute module integration tests
only 'compute/(motion|vulkan)' 'compute/motion/|compute/vulkan/|module/view/|module/xr/|module/session/|integration/|tests/' compute module integration tests
only 'compute/motion' 'compute/motion/|module/session/|integration/|tests/' compute module integration tests
only 'libusb' 'integration/devices/|tests/devices/' compute module integration tests
only 'openssl|qrencode' 'integration/web/|tests/web/' compute module integration tests
only 'tiny_gltf' 'integration/headset/' compute module integration tests
only 'boost' 'integration/devices/|integration/web/|tests/devices/|tests/web/' compute module integration tests
only 'shaders/interface' 'compute/motion/|module/view/|tests/' compute module integration tests
only 'vtk' 'integration/toolkit/vtk/|tests/toolkit/vtk/|tests/lab/bench/|tests/files/vtk_lines_test' compute module integration tests
only 'pybind11|Python' 'integration/toolkit/python/' compute module integration tests
only 'integration/(app|toolkit)' 'integration/app/|integration/toolkit/|tests/' compute module integration tests
only 'integration/desktop' 'integration/desktop/|integration/app/|tests/' compute module integration tests
only 'integration/headset' 'integration/headset/|integration/app/|tests/' compute module integration tests
only 'module/session' 'module/session/|integration/|tests/' compute module integration tests
only 'module/calibrate' 'module/calibrate/|integration/|tests/' compute module integration tests
only 'module/xr' 'module/xr/|module/session/|integration/|tests/' compute module integration tests
only 'module/view' 'module/view/|module/xr/|module/session/|integration/|tests/' compute module integration tests
only 'module/haptics/servo' 'module/haptics/servo/|module/haptics/scene_ticker|module/session/|integration/|tests/' compute module integration tests
only 'module/haptics/proxy' 'module/haptics/proxy/|module/haptics/scene_ticker|module/session/|integration/|tests/' compute module integration tests
only 'module/haptics/guard' 'module/haptics/(guard|proxy|modes)/|module/session/|integration/|tests/' compute module integration tests
only 'integration/files/scene' 'integration/files/scene/|integration/(x3d|loading|running|toolkit|headset|app|desktop)/|tests/' compute module integration tests
only 'module/haptics' 'module/haptics/|module/session/|integration/|tests/' compute module integration tests
only 'module/' 'module/|integration/|tests/' compute module integration tests
only 'tests/' 'tests/' compute module integration

# Libraries speak to every host: the names of command-line options stand in the program only.
flags=$(grep -rnE '"([^"\\]|\\.)*--[a-z]' --include='*.h' --include='*.cpp' compute module integration | grep -v '^integration/app/' || true)
if [[ -n $flags ]]; then
  echo "Only integration/app may name an option of the program, but these texts do too:"
  echo "$flags"
  failed=1
fi

# A device's failure is an exception inside compute/ and an error outside: vulkan::tried() is the border.
failures=$(grep -rnwE 'Failure' --include='*.h' --include='*.cpp' module integration || true)
if [[ -n $failures ]]; then
  echo "Only compute/ may name vulkan::Failure, but these files do too:"
  echo "$failures"
  failed=1
fi
exit $failed
