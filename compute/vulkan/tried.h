#pragma once

#include <type_traits>

#include "compute/volume/result.h"
#include "compute/vulkan/context.h"

namespace palpate::vulkan {

/// The type that tried() returns for a function that returns T: a Result or Status as it is, Status
/// instead of nothing, Result<T> instead of T. Never called.
template <class T>
Result<T> type_of_tried(std::type_identity<T>);
template <class T>
Result<T> type_of_tried(std::type_identity<Result<T>>);
Status type_of_tried(std::type_identity<void>);

/// Calls `work` and returns what it returns, or the error of its Failure: the border that no
/// Failure crosses. Every public function of a library that records or submits does its work in
/// here. Other exceptions pass. Any thread.
template <class Work>
auto tried(const Work& work)
    -> decltype(type_of_tried(std::type_identity<std::invoke_result_t<Work>>{})) {
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
      work();
      return Nothing{};
    } else {
      return work();
    }
  } catch (const Failure& failure) {
    return failure.error();
  }
}

}  // namespace palpate::vulkan
