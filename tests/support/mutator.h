#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::test {

/// Damages texts and bytes, as accidents and attackers do, from a fixed seed: changes, cuts,
/// removes and doubles bytes, and inserts pieces that the parser treats specially. So mutations
/// reach deeper into a parser than random bytes.
class Mutator {
 public:
  explicit Mutator(std::vector<std::string> pieces, uint32_t seed = 20240607)
      : pieces_(std::move(pieces)), generator_(seed) {}

  std::string mutated(std::string bytes) {
    const int changes = 1 + int(generator_() % 4);
    for (int n = 0; n < changes; ++n) change(bytes);
    return bytes;
  }

  /// Calls a parser with the seed itself and then with `rounds` mutations of it. Each is on the
  /// heap with its exact size, so that the address sanitizer detects a read of one byte too many.
  template <class Parse>
  void run(const std::string& seed, int rounds, const Parse& parse) {
    parse(std::string_view(seed));
    for (int n = 0; n < rounds; ++n) {
      const std::string bytes = mutated(seed);
      const std::vector<char> exact(bytes.begin(), bytes.end());
      parse(std::string_view(exact.data(), exact.size()));
    }
  }

 private:
  size_t below(size_t n) { return n == 0 ? 0 : generator_() % n; }

  void change(std::string& bytes) {
    const size_t at = below(bytes.size());
    switch (generator_() % 6) {
      case 0:
        if (!bytes.empty()) bytes[at] = char(generator_() & 0xff);
        break;
      case 1:
        bytes.resize(at);
        break;
      case 2:
        bytes.erase(at, below(20));
        break;
      case 3:
        bytes.insert(at, pieces_[below(pieces_.size())]);
        break;
      case 4: {
        const std::string& piece = pieces_[below(pieces_.size())];
        bytes.replace(at, std::min(piece.size(), bytes.size() - at), piece);
        break;
      }
      default:
        bytes.insert(at, bytes.substr(below(bytes.size()), below(60)));
    }
  }

  std::vector<std::string> pieces_;
  std::mt19937 generator_;
};

}  // namespace palpate::test
