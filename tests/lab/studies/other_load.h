#pragma once

#include <string>

namespace palpate::studies {

/// How much of the machine's cores other programs use while something is measured: a time taken on
/// a busy machine says little. Any thread.
class OtherLoad {
 public:
  OtherLoad();  ///< starts counting

  /// " Other programs used 0.03 cores meanwhile.", of the time since construction; empty where the
  /// system does not tell (it must have Linux' /proc/stat), or where that was too short to count.
  std::string sentence() const;

 private:
  double begin_s_ = 0.0;
  double others_begin_s_ = 0.0;  ///< core seconds; below zero: not known
};

}  // namespace palpate::studies
