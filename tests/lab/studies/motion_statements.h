#pragma once

#include <string>
#include <vector>

#include "tests/lab/studies/motion_study.h"

/// Sentences about measurements, computed from them alone.
namespace palpate::studies {

/// The choice for deadlines: one sentence per round number of seconds between the fastest and the
/// slowest setting on the front.
std::vector<std::string> deadline_sentences(const MotionMeasures& measures);

/// The choice for an error: one sentence per round number of mm between the best and the worst on
/// the front.
std::vector<std::string> error_sentences(const MotionMeasures& measures);

/// Each preset's place: on the front, or beaten, with the setting that beats it. A setting beats
/// another one if it is better in both by more than the margins of motion_choice.h.
std::vector<std::string> preset_sentences(const MotionMeasures& measures);

/// The best peer compared with the fastest preset that is at least as accurate, or that there is
/// none. Empty without peers.
std::string peer_sentence(const MotionMeasures& measures);

/// The effect of each sweep relative to the preset that it varies: better, worse or no different in
/// time and error.
std::vector<std::string> sweep_sentences(const MotionMeasures& measures);

/// "0.93 s", "12 ms": three figures.
std::string time_text(double seconds);

}  // namespace palpate::studies
