// OpenCV's and TBB's packages are not built for the thread sanitizer, which therefore does not see
// how their threads wait for each other. Our own races are still reported.
#if defined(__SANITIZE_THREAD__)
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "race:libopencv_core.so\n"
         "race:libopencv_imgproc.so\n"
         "race:libopencv_video.so\n"
         "race:libtbb.so\n";
}
#endif
