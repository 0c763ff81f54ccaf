#include "module/xr/vibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace palpate::test {
namespace {

using xr::vibration;

TEST(Vibration, GrowsWithTheForceFromNothingToOne) {
  EXPECT_EQ(vibration(0.0, 4.0), 0.0);
  EXPECT_EQ(vibration(0.03, 4.0), 0.0) << "below 1 % of the largest";
  EXPECT_DOUBLE_EQ(vibration(4.0, 4.0), 1.0);
  EXPECT_DOUBLE_EQ(vibration(40.0, 4.0), 1.0);
  EXPECT_DOUBLE_EQ(vibration(2.0, 4.0), std::pow(0.5, 0.7));
  double last = 0.0;
  for (double force = 0.05; force <= 4.0; force += 0.05) {
    EXPECT_GT(vibration(force, 4.0), last) << force;
    last = vibration(force, 4.0);
  }
}

TEST(Vibration, IsStillForWhatIsNoForce) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const auto& [force, most] :
       {std::pair{nan, 4.0}, {inf, 4.0}, {1.0, nan}, {1.0, 0.0}, {1.0, -1.0}, {1.0, inf}})
    EXPECT_EQ(vibration(force, most), 0.0) << force << " of " << most;
}

}  // namespace
}  // namespace palpate::test
