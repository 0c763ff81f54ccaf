#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>

/// The lines that a Polhem, and other WoodenHaptics devices with its firmware, exchange: text, 64
/// bytes with a line feed at the end (63 in an older firmware). Nothing here may be trusted: any
/// bytes give a value.
namespace palpate::devices::polhem {

inline constexpr size_t kLineBytes = 64;

/// A force on the hand, N, palpate's axes, finite, as the device wants it: whole mN, clamped to
/// what fits. Also what makes a device speak at all.
std::string force_line(glm::dvec3 force_n);

/// What a device says of itself in one line.
struct PolhemAnswer {
  glm::dvec3 position_m{0.0};  ///< of the grip, palpate's axes; finite
  int info = 0;                ///< 1: it asks to be calibrated
};
/// Nothing if the line, without its end, is no answer.
std::optional<PolhemAnswer> answer_of(std::string_view line);

/// Makes lines of bytes, however they are cut into pieces.
class LineSplitter {
 public:
  /// Bytes that came; the newest whole line that is an answer is kept.
  void read(std::string_view bytes);
  /// The newest answer since the last call.
  std::optional<PolhemAnswer> take() noexcept;
  /// Lines that were not empty, and whether one was no answer: for the caller to set back.
  int count = 0;
  bool garbage = false;

 private:
  void end_line();
  std::string line_;
  bool too_long_ = false;
  std::optional<PolhemAnswer> newest_;
};

}  // namespace palpate::devices::polhem
