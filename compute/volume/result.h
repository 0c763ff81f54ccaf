#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace palpate {

/// Why an operation failed that depends on the outside world (a file, a device, a driver).
enum class ErrorKind {
  kBadInput,      ///< The user's data or arguments are wrong: say what to change. Exit code 2.
  kNotFinite,     ///< kBadInput: samples of an image are NaN or infinite. Exit code 2.
  kBadOutput,     ///< The result could not be written: nothing was touched. Exit code 2.
  kNoDevice,      ///< No Vulkan device that can do the work. Exit code 2.
  kDeviceFailed,  ///< The device was lost or the driver refused. Exit code 1.
  kOutOfMemory,   ///< Neither host nor device can hold the work. Exit code 2.
  kCancelled,     ///< The caller asked to stop. Exit code 1.
};

/// One clear sentence for the user: which file, what is wrong, what to do.
struct Error {
  ErrorKind kind = ErrorKind::kBadInput;
  std::string message;
};

/// A value, or the reason why there is none. Library code never prints and never exits: it returns
/// this. Reason: Error, or a folder's own error type, where callers must distinguish more kinds.
template <class T, class Reason = Error>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}
  Result(Reason error) : state_(std::move(error)) {}

  explicit operator bool() const { return state_.index() == 0; }
  T& operator*() {
    assert(*this);
    return std::get<0>(state_);
  }
  const T& operator*() const {
    assert(*this);
    return std::get<0>(state_);
  }
  T* operator->() { return &**this; }
  const T* operator->() const { return &**this; }
  const Reason& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Reason> state_;
};

struct Nothing {};
using Status = Result<Nothing>;

}  // namespace palpate
