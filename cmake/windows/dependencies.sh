#!/usr/bin/env bash
# Builds what palpate takes from other libraries for Windows x64, from Debian's sources, without privileges: fmt, expat and GDCM as static
# libraries, an import library for the Vulkan loader, and the headers of those that are headers alone (Boost, Eigen, GLM, nlohmann-json, Vulkan). zlib is
# Debian's.
# usage: dependencies.sh FOLDER   (FOLDER/include, FOLDER/lib; made once, then kept)
set -euo pipefail
[[ $# == 1 ]] || { echo "usage: dependencies.sh FOLDER" >&2; exit 2; }
mkdir -p "$1"
out=$(cd "$1" && pwd)
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
[[ ! -e $out/complete ]] || exit 0

missing=()
for package in g++-mingw-w64-x86-64-posix libz-mingw-w64-dev cmake ninja-build dpkg-dev libboost-dev libeigen3-dev \
               libglm-dev nlohmann-json3-dev libvulkan-dev; do
  [[ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" == installed ]] || missing+=("$package")
done
((${#missing[@]} == 0)) || { echo "dependencies.sh: install ${missing[*]} first." >&2; exit 1; }

work=$out/work
mkdir -p "$work/apt/lists/partial" "$work/apt/parts" "$work/src" "$out/include" "$out/lib/cmake"
. /etc/os-release
cat >"$work/apt/parts/sources.sources" <<SOURCES
Types: deb-src
URIs: http://deb.debian.org/debian
Suites: $VERSION_CODENAME
Components: main
Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg
SOURCES
apt=(-q -o Dir::Etc::SourceList=/dev/null -o "Dir::Etc::SourceParts=$work/apt/parts" -o "Dir::State::Lists=$work/apt/lists"
     -o APT::Sandbox::User=root)
cd "$work/src"
apt-get "${apt[@]}" update
apt-get "${apt[@]}" source fmtlib expat gdcm

# Libraries that are headers alone, linked one by one: /usr/include itself has glibc's.
for headers in boost eigen3/Eigen eigen3/unsupported glm nlohmann vulkan vk_video; do
  ln -sfn "/usr/include/$headers" "$out/include/${headers##*/}"
done
header_package() {  # NAME TARGET
  mkdir -p "$out/lib/cmake/$1"
  cat >"$out/lib/cmake/$1/$1Config.cmake" <<CONFIG
if(NOT TARGET $2)
  add_library($2 INTERFACE IMPORTED)
  set_target_properties($2 PROPERTIES INTERFACE_INCLUDE_DIRECTORIES \${CMAKE_CURRENT_LIST_DIR}/../../../include)
endif()
CONFIG
}
header_package Boost Boost::headers
header_package Eigen3 Eigen3::Eigen
header_package nlohmann_json nlohmann_json::nlohmann_json

configure_and_install() {  # NAME SOURCE [OPTION...]
  # No source folder of this machine in the messages of the libraries.
  local flags="-ffile-prefix-map=$work/= -I$work/iconv"
  cmake -G Ninja -S "$2" -B "$work/$1" -DCMAKE_TOOLCHAIN_FILE="$here/toolchain.cmake" -DPALPATE_WINDOWS_LIBRARIES="$out" \
    -DCMAKE_C_FLAGS="$flags" -DCMAKE_CXX_FLAGS="$flags" -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$out" -DBUILD_SHARED_LIBS=OFF "${@:3}"
  cmake --build "$work/$1" -j "$(nproc)"
  cmake --install "$work/$1"
}
configure_and_install fmt fmtlib-*/ -DFMT_TEST=OFF -DFMT_DOC=OFF
# A security patch of Debian's asks for a value where CMake's template has none.
sed -i 's/#cmakedefine XML_DTD$/#define XML_DTD 1/' expat-*/expat/expat_config.h.cmake
configure_and_install expat expat-*/expat -DEXPAT_BUILD_TOOLS=OFF -DEXPAT_BUILD_EXAMPLES=OFF -DEXPAT_BUILD_TESTS=OFF -DEXPAT_SHARED_LIBS=OFF
# GDCM converts the texts of one maker's private elements, which palpate does not read, by functions that MinGW lacks: these
# say that they can not.
mkdir -p "$work/iconv"
cat >"$work/iconv/iconv.h" <<'HEADER'
#pragma once
#include <stddef.h>
typedef void* iconv_t;
static inline iconv_t iconv_open(const char* to, const char* from) { (void)to; (void)from; return (iconv_t)-1; }
static inline size_t iconv(iconv_t c, char** in, size_t* in_left, char** out, size_t* out_left) {
  (void)c; (void)in; (void)in_left; (void)out; (void)out_left;
  return (size_t)-1;
}
static inline int iconv_close(iconv_t c) { (void)c; return 0; }
HEADER
configure_and_install gdcm gdcm-*/ -DGDCM_BUILD_APPLICATIONS=OFF -DGDCM_BUILD_TESTING=OFF -DGDCM_BUILD_EXAMPLES=OFF \
  -DGDCM_DOCUMENTATION=OFF -DGDCM_BUILD_SHARED_LIBS=OFF -DGDCM_USE_SYSTEM_ZLIB=ON -DGDCM_USE_SYSTEM_EXPAT=ON

# The loader belongs to the graphics driver: what is linked are its names, which are the same on every system.
vulkan=$(ldconfig -p | awk '/libvulkan\.so\.1 .*x86-64/ && !found {print $NF; found = 1}')
{ echo "LIBRARY vulkan-1.dll"; echo EXPORTS; nm -D --defined-only "$vulkan" | awk '$3 ~ /^vk[A-Z]/ {print $3}'; } >"$work/vulkan-1.def"
x86_64-w64-mingw32-dlltool -d "$work/vulkan-1.def" -l "$out/lib/libvulkan-1.dll.a"

# The library has these inside, so their licences go with it.
mkdir -p "$out/licences"
for source in fmtlib expat gdcm; do cp "$work/src/$source"-*/debian/copyright "$out/licences/$source.txt"; done
for package in libboost-dev libeigen3-dev libglm-dev nlohmann-json3-dev libz-mingw-w64-dev g++-mingw-w64-x86-64-posix; do
  cp -L "/usr/share/doc/$package/copyright" "$out/licences/$package.txt"
done

rm -r "$work"
touch "$out/complete"
