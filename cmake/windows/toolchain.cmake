# Cross-builds for Windows x64 with Debian's MinGW-w64 (posix threads: std::thread). What dependencies.sh made is found in
# PALPATE_WINDOWS_LIBRARIES; nothing of this machine's own libraries is.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR AMD64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(PALPATE_WINDOWS_LIBRARIES ${CMAKE_CURRENT_LIST_DIR}/../../build-windows/libraries CACHE PATH "What dependencies.sh made")
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES PALPATE_WINDOWS_LIBRARIES)
set(CMAKE_FIND_ROOT_PATH ${PALPATE_WINDOWS_LIBRARIES} /usr/x86_64-w64-mingw32)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
# Libraries that describe themselves to pkg-config, with all that they need: they are static.
set(ENV{PKG_CONFIG_LIBDIR} ${PALPATE_WINDOWS_LIBRARIES}/lib/pkgconfig)
set(PKG_CONFIG_ARGN --static CACHE STRING "")
include_directories(SYSTEM ${PALPATE_WINDOWS_LIBRARIES}/include)
# Windows 10.
add_compile_definitions(_WIN32_WINNT=0x0A00 WINVER=0x0A00)
# One file for users: no DLL of the compiler's or of zlib's beside it.
set(ZLIB_LIBRARY /usr/x86_64-w64-mingw32/lib/libz.a)
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
set(CMAKE_SHARED_LINKER_FLAGS_INIT -static)
set(CMAKE_MODULE_LINKER_FLAGS_INIT -static)
