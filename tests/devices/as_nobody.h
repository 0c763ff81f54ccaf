#pragma once

#include <sys/fsuid.h>
#include <unistd.h>

namespace palpate::devices::test {

/// During its life this thread, and threads that it starts, open files as an ordinary user: root
/// may open everything, and the tests may run as root.
class AsNobody {
 public:
  AsNobody() {
    if (geteuid() == 0) setfsuid(65534);
  }
  ~AsNobody() { setfsuid(geteuid()); }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;
};

}  // namespace palpate::devices::test
