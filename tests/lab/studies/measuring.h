#pragma once

#include <stdexcept>
#include <vector>

namespace palpate::studies {

/// A benchmark's own check failed, or what it needs is not there; what() is a sentence for a
/// person.
class Mismatch : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Seconds since some moment.
double now_s();

/// The middle value (of an even number, the lower one of the two in the middle). Needs one at
/// least.
double median(std::vector<double> values);

}  // namespace palpate::studies
