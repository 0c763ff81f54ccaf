#!/usr/bin/env bash
# Builds what palpate takes from other libraries for Windows x64, from Debian's sources, without privileges, as static libraries; an import library
# for the Vulkan loader, and the headers of those that are headers alone (Boost, CLI11, Eigen, GLM, nlohmann-json, stb, Vulkan). zlib is Debian's. Half an
# hour on two cores that had other work, too.
# usage: dependencies.sh FOLDER   (FOLDER/include, FOLDER/lib; made once, then kept)
set -euo pipefail
[[ $# == 1 ]] || { echo "usage: dependencies.sh FOLDER" >&2; exit 2; }
mkdir -p "$1"
out=$(cd "$1" && pwd)
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
[[ ! -e $out/complete ]] || exit 0

missing=()
for package in g++-mingw-w64-x86-64-posix libz-mingw-w64-dev cmake make meson ninja-build pkg-config dpkg-dev libboost-dev libcli11-dev \
               libeigen3-dev libglm-dev nlohmann-json3-dev libstb-dev libvulkan-dev; do
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
apt-get "${apt[@]}" source fmtlib expat gdcm libpng1.6 cairo openssl glfw3 libjsoncpp openxr-sdk-source opencv tinygltf
# Debian changes nothing in these two that is built here.
apt-get "${apt[@]}" --tar-only source pixman qrencode
for packed in pixman_*.tar.* qrencode_*.tar.*; do tar -xf "$packed"; done

# Libraries that are headers alone, linked one by one: /usr/include itself has glibc's.
for headers in boost eigen3/Eigen eigen3/unsupported glm nlohmann stb vulkan vk_video CLI; do
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
header_package CLI11 CLI11::CLI11

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
configure_and_install png libpng1.6-*/ -DPNG_SHARED=OFF -DPNG_TESTS=OFF -DPNG_EXECUTABLES=OFF
configure_and_install qrencode qrencode-*/ -DWITH_TOOLS=OFF -DWITHOUT_PNG=ON
configure_and_install glfw glfw3-*/ -DGLFW_BUILD_EXAMPLES=OFF -DGLFW_BUILD_TESTS=OFF -DGLFW_BUILD_DOCS=OFF
configure_and_install jsoncpp libjsoncpp-*/ -DJSONCPP_WITH_TESTS=OFF -DJSONCPP_WITH_POST_BUILD_UNITTEST=OFF -DBUILD_OBJECT_LIBS=OFF
configure_and_install openxr openxr-sdk-source-*/ -DDYNAMIC_LOADER=OFF -DBUILD_TESTS=OFF -DBUILD_API_LAYERS=OFF -DBUILD_CONFORMANCE_TESTS=OFF \
  -DBUILD_WITH_SYSTEM_JSONCPP=ON -DJSONCPP_INCLUDE_DIRS="$out/include" -DJSONCPP_LIBRARIES="$out/lib/libjsoncpp.a"
# It names the library for JSON by a target that nobody makes for it.
sed -i -E 's/(\\\$<LINK_ONLY:)?JsonCpp::JsonCpp>?/${_IMPORT_PREFIX}\/lib\/libjsoncpp.a/' "$out/cmake/OpenXRTargets.cmake"
# What palpate's second opinion on fields needs of it, and no more.
configure_and_install opencv opencv-*/ -DBUILD_LIST=core,imgproc,video -DBUILD_TESTS=OFF -DBUILD_PERF_TESTS=OFF -DBUILD_EXAMPLES=OFF \
  -DBUILD_opencv_apps=OFF -DBUILD_ZLIB=OFF $(printf -- '-DWITH_%s=OFF ' IPP OPENCL FFMPEG PROTOBUF EIGEN JPEG PNG TIFF WEBP OPENJPEG JASPER OPENEXR \
    ITT QUIRC ADE WIN32UI DSHOW MSMF DIRECTX LAPACK)
# Debian's stb is a library for Linux: here its functions are compiled with those that call them.
sed -i 's/find_package(nlohmann_json 3 /find_package(nlohmann_json /' tinygltf-*/CMakeLists.txt
configure_and_install tinygltf tinygltf-*/ -DTINYGLTF_BUILD_LOADER_EXAMPLE=OFF -DBUILD_TESTING=OFF -Dstb_LIBRARY:STRING=m \
  "-DCMAKE_CXX_FLAGS=-DSTB_IMAGE_IMPLEMENTATION -DSTB_IMAGE_WRITE_IMPLEMENTATION -ffile-prefix-map=$work/="
# It needs nothing else.
sed -i '/INTERFACE_LINK_LIBRARIES/d' "$out/lib/cmake/TinyGLTF/TinyGLTFTargets.cmake"

# pixman by Meson, cairo by its configure script, OpenSSL by its own.
cross=x86_64-w64-mingw32
cat >"$work/cross.ini" <<CROSS
[binaries]
c = '$cross-gcc-posix'
ar = '$cross-ar'
strip = '$cross-strip'
windres = '$cross-windres'
[built-in options]
c_args = ['-ffile-prefix-map=$work/=']
[host_machine]
system = 'windows'
cpu_family = 'x86_64'
cpu = 'x86_64'
endian = 'little'
CROSS
meson setup --cross-file "$work/cross.ini" --prefix "$out" --libdir lib --default-library static --buildtype release "$work/pixman" \
  "$work"/src/pixman-*/ $(printf -- '-D%s=disabled ' gtk libpng tests openmp)
meson install -C "$work/pixman"

printf 'Name: zlib\nDescription: of MinGW\nVersion: 1.2.13\nLibs: /usr/%s/lib/libz.a\n' "$cross" >"$out/lib/pkgconfig/zlib.pc"
# One time for all files: its makefiles would call the tools that made them otherwise.
find "$work"/src/cairo-*/ -exec touch -r "$work"/src/cairo-*/configure {} +
mkdir "$work/cairo"
cd "$work/cairo"
PKG_CONFIG_LIBDIR=$out/lib/pkgconfig PKG_CONFIG="pkg-config --static" CC=$cross-gcc-posix CXX=$cross-g++-posix \
  CFLAGS="-O2 -Wp,-U_FORTIFY_SOURCE -ffile-prefix-map=$work/=" CPPFLAGS="-DCAIRO_WIN32_STATIC_BUILD -D_WIN32_WINNT=0x0A00" \
  "$work"/src/cairo-*/configure --host=$cross --prefix="$out" --enable-static --disable-shared --enable-win32 --enable-win32-font --enable-png \
    $(printf -- '--disable-%s ' xlib xcb ft fc ps pdf svg script tee xml gobject interpreter trace valgrind gtk-doc)
make -C src -j "$(nproc)" install
make install-data

mkdir "$work/openssl"
cd "$work/openssl"
"$work"/src/openssl-*/Configure mingw64 no-shared no-tests no-engine no-dso --cross-compile-prefix=$cross- --prefix="$out" --libdir=lib \
  --openssldir=/none "-ffile-prefix-map=$work/="
make -j "$(nproc)" build_libs
make install_dev

# The loader belongs to the graphics driver: what is linked are its names, which are the same on every system.
vulkan=$(ldconfig -p | awk '/libvulkan\.so\.1 .*x86-64/ && !found {print $NF; found = 1}')
{ echo "LIBRARY vulkan-1.dll"; echo EXPORTS; nm -D --defined-only "$vulkan" | awk '$3 ~ /^vk[A-Z]/ {print $3}'; } >"$work/vulkan-1.def"
x86_64-w64-mingw32-dlltool -d "$work/vulkan-1.def" -l "$out/lib/libvulkan-1.dll.a"

# The library has these inside, so their licences go with it.
mkdir -p "$out/licences"
for source in fmtlib expat gdcm libpng1.6 cairo openssl glfw3 libjsoncpp openxr-sdk-source opencv tinygltf; do
  cp "$work/src/$source"-*/debian/copyright "$out/licences/$source.txt"
done
cp "$work"/src/pixman-*/COPYING "$out/licences/pixman.txt"
cp "$work"/src/qrencode-*/COPYING "$out/licences/qrencode.txt"
for package in libboost-dev libcli11-dev libeigen3-dev libglm-dev nlohmann-json3-dev libstb-dev libz-mingw-w64-dev g++-mingw-w64-x86-64-posix; do
  cp -L "/usr/share/doc/$package/copyright" "$out/licences/$package.txt"
done

rm -r "$work"
touch "$out/complete"
