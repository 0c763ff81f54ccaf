#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "integration/devices/falcon_kinematics.h"
#include "integration/devices/falcon_protocol.h"

/// Bytes of a broken or malicious device: every byte is either in an answer or counted, and no
/// answer gives a position that is NaN.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace palpate::devices::falcon;
  AnswerStream stream;
  uint64_t answers = 0;
  for (size_t at = 0; at < size;) {
    const size_t count = std::min<size_t>(1 + data[at] % 62, size - at);
    const int found = stream.read({data + at, count});
    answers += uint64_t(found);
    at += count;
    if (found == 0) continue;
    const auto place = forward(arm_angles(stream.newest().encoders), kWorkspaceCentre);
    if (place && !(glm::dot(place->metres, place->metres) < 1.0)) std::abort();
  }
  const uint64_t used = stream.rejected_bytes() + kPacketBytes * answers;
  if (used > size || size - used >= kPacketBytes) std::abort();
  return 0;
}
