// Texts that a user may write for a deadline or an error.
#include "integration/app/choice/quantity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/lab/tests/studies/fuzz/quantity_bytes.h"
#include "tests/support/mutator.h"

namespace palpate::studies {
namespace {

TEST(Quantity, IsANumberWithItsUnitOrWithout) {
  for (const auto& [text, seconds] :
       {std::pair("2s", 2.0), std::pair("500ms", 0.5), std::pair("1.5min", 90.0),
        std::pair("2", 2.0), std::pair("2 s", 2.0), std::pair("1e-3s", 1e-3)}) {
    const auto found = app::parse_seconds(text);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_DOUBLE_EQ(*found, seconds) << text;
  }
  for (const auto& [text, mm] : {std::pair("0.5mm", 0.5), std::pair("500um", 0.5),
                                 std::pair("0.05cm", 0.5), std::pair("0.5", 0.5)}) {
    const auto found = app::parse_millimetres(text);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_DOUBLE_EQ(*found, mm) << text;
  }
}

TEST(Quantity, ThatIsNoneIsRefusedWithAnExample) {
  for (const char* text : {"", "s", "2 hours", "0", "-1s", "nan", "inf", "2mm", "1e308min",
                           "1e-323ms", "2s2", "1,5s", " 2s"}) {
    const auto found = app::parse_seconds(text);
    ASSERT_FALSE(found) << text;
    EXPECT_THAT(found.error().message, testing::HasSubstr("like 2s or 500ms."));
  }
  EXPECT_FALSE(app::parse_millimetres("2s"));
  EXPECT_FALSE(app::parse_millimetres("1e308cm"));
}

TEST(Quantity, OfAnyBytesIsSoundOrRefused) {
  test::Mutator mutator({"-", "0", "1e308", "1e-320", "nan", "inf", "ms", "min", "um", " ", ".",
                         "e", "99999999999999999999", "\xff"});
  for (const char* seed : {"2s", "500ms", "0.5mm", "1.5e0 min"})
    mutator.run(seed, 4000, fuzz::parse_quantity_bytes);
}

}  // namespace
}  // namespace palpate::studies
