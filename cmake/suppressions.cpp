#include <dlfcn.h>

/// What the sanitizers must pass over. Drivers, the validation layers, OpenCV, TBB, ITK and the
/// emulated USB bus are not built with them, so that their own locks and lists can not be followed.
/// EmulatedDevice stands in for the kernel: it reads and writes what libusb hands over with an
/// ioctl, on a thread that is told of it through umockdev's socket.
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libVkLayer_khronos_validation.so\n"
         "called_from_lib:libvulkan_lvp.so\n"
         "race:libVkLayer_khronos_validation.so\n"
         "race:libvulkan_lvp.so\n"
         "race:libLLVM\n"
         "race:swrast_dri.so\n"
         "race:libopencv_core.so\n"
         "race:libopencv_imgproc.so\n"
         "race:libopencv_video.so\n"
         "race:libtbb.so\n"
         "race:EmulatedDevice\n"
         "race:libumockdev\n"
         "race:libglib-2.0\n"
         "race:^itk::\n"
         "race:itk_oracle\n";
}

/// The driver's compiler holds one lock per kernel, more at a time than the search for deadlocks
/// can count (64).
extern "C" const char* __tsan_default_options();
extern "C" const char* __tsan_default_options() {
  return "detect_deadlocks=0";
}

/// The driver and fontconfig keep what they have made until the process ends; Debian's OpenXR
/// loader loses 88 bytes per instance.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libVkLayer_khronos_validation.so\n"
         "leak:libvulkan_lvp.so\n"
         "leak:libvulkan.so\n"
         "leak:libLLVM\n"
         "leak:libopenxr_loader.so\n"
         "leak:libfontconfig\n";
}

namespace {

/// The loader unloads both when a device closes, and a leak can not be traced to a library that is
/// gone: kept in memory to the end.
struct StayLoaded {
  StayLoaded() {
    dlopen("libVkLayer_khronos_validation.so", RTLD_LAZY | RTLD_NODELETE);
    dlopen("libvulkan_lvp.so", RTLD_LAZY | RTLD_NODELETE);
  }
} const stay_loaded;

}  // namespace
