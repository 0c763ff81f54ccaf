#pragma once

#include "tests/lab/stability/shell.h"

/// Makes the beating shell and the hand on it available in the tests' namespace.
namespace palpate::test {

using stability::Ball;
using stability::Hand;
using stability::kOuterMm;
using stability::Made;
using stability::shell;
using stability::shell_frame;
using stability::shell_grid;
using stability::shell_radius_m;
using stability::shell_radius_mm;
using stability::shell_spec;
using stability::unmetered;

}  // namespace palpate::test
