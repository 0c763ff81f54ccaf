// Damaged reports of a puck, from a fixed seed.
#include <gtest/gtest.h>

#include "tests/devices/fuzz/spacemouse_bytes.h"
#include "tests/support/mutator.h"

namespace palpate::devices {
namespace {

using namespace std::string_literals;

TEST(SpacemouseFuzz, ReaderHolds) {
  const std::vector<std::string> pieces = {"\x01"s,     "\x02"s,     "\x03"s,     "\x00"s,
                                           "\xff\xff"s, "\x5e\x01"s, "\x00\x80"s, "\x07\x01"s};
  test::Mutator mutator(pieces);
  // Each report is preceded by the number of its bytes.
  mutator.run("\x07\x01\x10\x00\x20\x00\x5e\x01"s, 20'000, fuzz::read_spacemouse_bytes);
  mutator.run("\x0d\x01\x10\x00\x20\x00\x5e\x01\xa2\xfe\x00\x00\x01\x00\x03\x03\x05\x00"s, 20'000,
              fuzz::read_spacemouse_bytes);
}

}  // namespace
}  // namespace palpate::devices
