#include <csignal>
#include <cstdlib>

#include "integration/app/process.h"

namespace palpate::app {

void prepare_process(int&, char**&) {
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
}

void set_if_missing(const char* name, const char* value) {
  setenv(name, value, 0);
}

}  // namespace palpate::app
