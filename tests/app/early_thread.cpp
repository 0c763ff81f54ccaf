// Stands for a library that starts a thread when it is loaded (OpenBLAS does): the thread is older
// than main(), so it blocks no signal.
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
