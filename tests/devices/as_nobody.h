#pragma once

#include <sys/fsuid.h>
#include <unistd.h>

namespace palpate::devices::test {

/// While it lives, this thread and those it starts open files as an ordinary user would: root may
/// open everything, and the tests may run as root.
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
