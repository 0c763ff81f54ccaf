// Thousands of damaged paths from a fixed seed: none may crash, hang or give an invalid path.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "tests/devices/fuzz/parse_path_bytes.h"

namespace palpate::devices {
namespace {

constexpr int kRounds = 20000;
constexpr const char* kPieces[] = {
    "nan", "-inf", "1e308", "1e-320", ",", ",,",       "\n",        "\r\n",       "#", "-0",
    "+",   "t_s",  "0x1",   "1e9",    " ", "\xff\xff", "0,0,0,0\n", "4294967296", "-1"};

TEST(PathFuzz, ParserHolds) {
  std::mt19937 generator(20260101);
  const auto below = [&](size_t n) { return n == 0 ? size_t(0) : size_t(generator()) % n; };
  const std::string seeds[] = {
      "t_s,x_m,y_m,z_m,buttons\n0,0,0.01,0,0\n0.5,0,-0.01,0,1\n1,0,0,0,3\n",
      "0,1,2,3\n1,2,3,4\n# end\n2,-1,0,1\n3,1e-3,2e-3,3e-3\n"};
  for (const std::string& seed : seeds) {
    fuzz::parse_path_bytes(seed);
    for (int round = 0; round < kRounds; ++round) {
      std::string bytes = seed;
      for (size_t change = 0; change <= below(4); ++change) {
        const size_t at = below(bytes.size());
        switch (below(4)) {
          case 0:
            if (!bytes.empty()) bytes[at] = char(generator() & 0xff);
            break;
          case 1:
            bytes.erase(at, below(12));
            break;
          case 2:
            bytes.insert(at, kPieces[below(std::size(kPieces))]);
            break;
          default:
            bytes.insert(at, bytes.substr(below(bytes.size()), below(40)));
        }
      }
      // On the heap and of exact size, so that the address sanitizer detects a read of one byte too
      // many.
      const std::vector<char> exact(bytes.begin(), bytes.end());
      fuzz::parse_path_bytes({exact.data(), exact.size()});
    }
  }
}

}  // namespace
}  // namespace palpate::devices
