#pragma once

#include <exception>
#include <new>
#include <string>

#include "compute/volume/result.h"
#include "compute/vulkan/tried.h"

namespace palpate {

/// Returns what `work` returns (a Status or a Result), or an error with the message of its
/// exception. For the outermost function of a thread, which no exception may leave (the process
/// would end). Any thread.
template <class Work>
auto caught(const Work& work) -> decltype(work()) {
  try {
    return vulkan::tried(work);
  } catch (const std::bad_alloc&) {
    return Error{ErrorKind::kOutOfMemory,
                 "The host ran out of memory: crop the volume or close other programs."};
  } catch (const std::exception& error) {
    return Error{ErrorKind::kBadInput,
                 std::string("A function that is called here threw an exception: ") + error.what()};
  } catch (...) {
    return Error{ErrorKind::kBadInput,
                 "A function that is called here threw an exception without a message"};
  }
}

}  // namespace palpate
