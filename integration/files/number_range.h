#pragma once

#include <limits>
#include <string>

namespace palpate::files {

/// The numbers that an option or a key takes.
struct NumberRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool above_low = false;  ///< low itself is not allowed
};
inline constexpr NumberRange kAnyNumber{};
inline constexpr NumberRange kNotNegative{0.0};
inline constexpr NumberRange kPositive{0.0, std::numeric_limits<double>::infinity(), true};

/// What the command line and the scene file both take. No force device gives more than 100 N or
/// holds more than 1e5 N/m; dry friction above 10 is known of no pair of materials.
inline constexpr NumberRange kForces_n{0.01, 100.0};
inline constexpr NumberRange kStiffnesses_n_per_m{1.0, 1e5};
inline constexpr NumberRange kStrengths_n{0.0, 1000.0};  ///< a surface may hold more than is felt
inline constexpr NumberRange kFrictions{0.0, 10.0};
inline constexpr NumberRange kSmoothings_mm{0.0, 100.0};
inline constexpr NumberRange kSoftnesses_m{1e-6, 10.0};  ///< of a charge
inline constexpr NumberRange kRawSizes{1.0, 65'536.0};   ///< samples along an axis
inline constexpr NumberRange kFrameRates{0.001, 1e5};    ///< frames per second

/// False also for values that are not finite.
bool is_in(double value, const NumberRange& range);

/// "a number from 1 to 5", "a number above 0", "a number not below 0", "a number".
std::string text_of(const NumberRange& range);

}  // namespace palpate::files
