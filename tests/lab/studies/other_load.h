#pragma once

#include <string>

namespace palpate::studies {

/// How much of the machine's cores other programs use during a measurement: a time measured on a
/// busy machine means little. Any thread.
class OtherLoad {
 public:
  OtherLoad();  ///< starts counting

  /// " Other programs used 0.03 cores meanwhile.", for the time since construction; empty if the
  /// system does not report it (Linux' /proc/stat is needed), or if the time was too short.
  std::string sentence() const;

 private:
  double begin_s_ = 0.0;
  double others_begin_s_ = 0.0;  ///< core seconds; below zero: not known
};

}  // namespace palpate::studies
