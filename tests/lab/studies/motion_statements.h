#pragma once

#include <string>
#include <vector>

#include "tests/lab/studies/motion_study.h"

/// What follows from measurements: sentences for the answer, and tables. All is computed from the
/// measurements alone.
namespace palpate::studies {

/// The choice for deadlines: one sentence per round number of seconds between the fastest and the
/// slowest setting on the front.
std::vector<std::string> deadline_sentences(const MotionMeasures& measures);

/// The choice for deadlines and for errors: one row per round number of seconds, and of mm, between
/// the ends of the front. Without rows if nothing of palpate was measured.
report::Table choice_table(const MotionMeasures& measures);

/// Each preset, and the setting that beats it: better in both by more than the margins of
/// motion_study.h.
report::Table preset_table(const MotionMeasures& measures);

/// The best peer compared with the fastest preset that is at least as accurate, or that there is
/// none. Empty without peers.
std::string peer_sentence(const MotionMeasures& measures);

/// The effect of each sweep in time and error relative to the preset that it varies.
report::Table sweep_table(const MotionMeasures& measures);

/// "0.93 s", "12 ms": three figures.
std::string time_text(double seconds);

}  // namespace palpate::studies
