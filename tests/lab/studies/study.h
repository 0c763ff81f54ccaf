#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <stop_token>
#include <string>

#include "tests/lab/studies/measuring.h"

namespace palpate::vulkan {
class Context;
}

namespace palpate::studies {

/// The common parameters of all studies. Studies take minutes, check `stop` between measurements,
/// and throw Mismatch or vulkan::Failure if a measurement can not be made or would mean nothing.
struct StudyRun {
  std::shared_ptr<vulkan::Context> context;
  bool quick = false;  ///< fewer settings on smaller data: everything within about a minute
  int runs = 3;        ///< timed runs, of which the median counts
  std::stop_token stop;
  /// When this study should be done, by now_s(). Measurements that do not fit are left out, and
  /// named in the report.
  double end_s = std::numeric_limits<double>::infinity();
  /// The share of this study that is done, 0 to 1, and what is measured now. May be empty.
  std::function<void(double share, const std::string& doing)> progress;

  /// Seconds until end_s; never below zero.
  double left_s() const { return std::max(0.0, end_s - now_s()); }
  void tell(double share, const std::string& doing) const {
    if (progress) progress(share, doing);
  }
};

}  // namespace palpate::studies
