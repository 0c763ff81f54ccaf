#pragma once

#include <utility>

#include "compute/volume/result.h"
#include "tests/lab/report/table.h"
#include "tests/lab/studies/measuring.h"
#include "tests/lab/studies/other_load.h"

namespace palpate::bench {

/// Tables and clocks are those of the report.
using namespace palpate::report;
using namespace palpate::studies;

/// The result of a call; throws Mismatch with its message if the call failed.
template <class T>
T value_or_throw(Result<T> result) {
  if (!result) throw Mismatch(result.error().message);
  return std::move(*result);
}

}  // namespace palpate::bench
