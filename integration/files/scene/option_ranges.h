#pragma once

#include "integration/files/scene/number_range.h"
#include "module/scene/scene_spec.h"

namespace palpate::files {

/// What the options of a session and the keys of a scene take: one definition for the command line,
/// the C library (palpate.h), Python, scene files and X3D.

/// How long a command runs.
inline constexpr NumberRange kRunTimes_s{0.1, 1e6, false, "s"};

/// Of a session. No force device gives more than 100 N or holds more than 1e5 N/m.
inline constexpr NumberRange kForces_n{0.01, 100.0, false, "N"};
inline constexpr NumberRange kStiffnesses_n_per_m{1.0, 1e5, false, "N/m"};
/// Of the ball that feels. A larger one than a fingertip would hide what it touches.
inline constexpr NumberRange kToolRadii_m{0.0, 0.02, false, "m"};
inline constexpr NumberRange kToolRadii_mm{0.0, 20.0, false, "mm"};
inline constexpr NumberRange kToolPoints{1.0, kMostToolPoints};
/// Ticks further apart are late. Beyond a second a device that does not answer would hold its force
/// for longer than a hand can wait.
inline constexpr NumberRange kWatchdogs_s{0.001, 1.0, false, "s"};
inline constexpr NumberRange kLettingGo_s{0.0, 1e6, false, "s"};  ///< of a simulated hand
inline constexpr NumberRange kPorts{1.0, 65'535.0};
inline constexpr NumberRange kCores{0.0, 1023.0};
inline constexpr NumberRange kButtonBits{0.0, 4'294'967'295.0};
/// Factors on the strengths of a mode.
inline constexpr NumberRange kGains{0.0, 100.0};

/// Of a sequence that is felt without a scene file.
inline constexpr NumberRange kSurfaceStrengths_n{0.01, 1000.0, false, "N"};
inline constexpr NumberRange kLookLevels{-1e9, 1e9};
inline constexpr NumberRange kWidths{0.0, std::numeric_limits<double>::infinity(), true};
inline constexpr NumberRange kFrameRates{0.001, 1e5, false, "frames per second"};
inline constexpr NumberRange kScales{1e-4, 1e4};
inline constexpr NumberRange kFrameNumbers{0.0, 1e6};
inline constexpr NumberRange kWaits_s{0.001, 1e6, false, "s"};  ///< for a server's first image

/// Of the estimation.
inline constexpr NumberRange kIterations{1.0, 10'000.0};
inline constexpr NumberRange kDeviceMemory_mb{0.01, 1e9, false, "MB"};

/// Of the modes and volumes of a scene. A surface may hold more than is felt; dry friction above 10
/// is known of no pair of materials.
inline constexpr NumberRange kStrengths_n{0.0, 1000.0, false, "N"};
inline constexpr NumberRange kFrictions{0.0, 10.0};
inline constexpr NumberRange kDampings_n_s_per_m{0.0, 1000.0, false, "N s/m"};
inline constexpr NumberRange kRanges_m{0.0, 10.0, false, "m"};  ///< of a mode, of a drive
inline constexpr NumberRange kEdges_m{1e-4, 100.0, false, "m"};
inline constexpr NumberRange kSmoothings_mm{0.0, 100.0, false, "mm"};
inline constexpr NumberRange kSoftnesses_m{1e-6, 10.0, false, "m"};  ///< of a charge
inline constexpr NumberRange kRawSizes{1.0, 65'536.0};               ///< samples along an axis

}  // namespace palpate::files
