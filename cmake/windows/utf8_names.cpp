// libstdc++ before version 13 takes the char of a path for what mbrtowc() makes of it, which is
// Latin-1 on Windows, and gives UTF-8 back. All names in palpate are UTF-8, so the linker puts this
// in the place of mbrtowc() (--wrap).
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <cwchar>

/// The next unit of UTF-16. Of a character that has two of them three bytes make the first, and the
/// last byte the second.
extern "C" size_t __wrap_mbrtowc(wchar_t* to, const char* from, size_t n, mbstate_t* state) {
  constexpr size_t kInvalid = size_t(-1), kIncomplete = size_t(-2);
  static_assert(sizeof(mbstate_t) >= sizeof(uint16_t));
  static thread_local mbstate_t own{};
  if (!state) state = &own;
  if (!from) {
    std::memset(state, 0, sizeof *state);
    return 0;
  }
  if (n == 0) return kIncomplete;
  uint16_t second = 0;
  std::memcpy(&second, state, sizeof second);
  if (second != 0) {
    std::memset(state, 0, sizeof *state);
    if (to) *to = wchar_t(second);
    return 1;
  }
  const auto byte = [from](size_t k) { return uint32_t(uint8_t(from[k])); };
  const uint32_t lead = byte(0);
  const size_t bytes = lead < 0x80                   ? 1
                       : lead >= 0xC2 && lead < 0xE0 ? 2
                       : lead >= 0xE0 && lead < 0xF0 ? 3
                       : lead >= 0xF0 && lead < 0xF5 ? 4
                                                     : 0;
  if (bytes == 0) return kInvalid;
  uint32_t code = bytes == 1 ? lead : lead & (0x7FU >> bytes);
  for (size_t k = 1; k < bytes; ++k) {
    if (k == n) return kIncomplete;
    if (byte(k) >> 6 != 2) return kInvalid;
    code = code << 6 | (byte(k) & 0x3F);
  }
  constexpr uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast[bytes] || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) return kInvalid;
  if (bytes < 4) {
    if (to) *to = wchar_t(code);
    return code == 0 ? 0 : bytes;
  }
  second = uint16_t(0xDC00 + (code & 0x3FF));
  std::memcpy(state, &second, sizeof second);
  if (to) *to = wchar_t(0xD800 + ((code - 0x10000) >> 10));
  return 3;
}
