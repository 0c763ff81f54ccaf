#pragma once

#include <string>

#include "tests/lab/studies/motion_study.h"

namespace palpate::test {

/// A row as if measured: one of palpate's settings.
inline studies::MotionMeasure ours(const std::string& name, double seconds, double error_mm,
                                   bool preset = false) {
  studies::MotionMeasure row;
  row.name = name;
  row.family = preset ? "palpate, presets" : "palpate, other settings";
  row.ours = row.careful = true;
  row.preset = preset;
  row.seconds = seconds;
  row.error_mm = error_mm;
  row.voxel_mm = 2.0;
  return row;
}

inline studies::MotionMeasure peer(const std::string& name, double seconds, double error_mm) {
  studies::MotionMeasure row = ours(name, seconds, error_mm);
  row.family = "ITK";
  row.ours = row.careful = false;
  return row;
}

inline studies::MotionMeasures measures(std::vector<studies::MotionMeasure> rows) {
  return {"made", "a synthetic pair", 1000000, 2.0, 5.0, std::move(rows), {}};
}

}  // namespace palpate::test
