// Replaces a library that starts a thread when it is loaded (as OpenBLAS does): the thread starts
// before main(), so it blocks no signal.
#include <unistd.h>

#include <thread>

namespace {

const bool kStarted = [] {
  std::thread([] {
    for (;;) ::pause();
  }).detach();
  return true;
}();

}  // namespace
