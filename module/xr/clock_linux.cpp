#include "module/xr/clock.h"

namespace palpate::xr {

int64_t ns_of(SystemTime time) {
  return int64_t(time.tv_sec) * kSecond_ns + int64_t(time.tv_nsec);
}

}  // namespace palpate::xr
