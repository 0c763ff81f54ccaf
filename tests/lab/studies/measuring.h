#pragma once

#include <stdexcept>
#include <vector>

namespace palpate::studies {

/// A benchmark's own check failed, or something that it needs is missing; what() is a message for
/// the user.
class Mismatch : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Seconds since an arbitrary time.
double now_s();

/// The median (of an even number, the lower one of the two in the middle). Needs at least one
/// value.
double median(std::vector<double> values);

}  // namespace palpate::studies
