#include "tests/lab/tests/studies/fuzz/quantity_bytes.h"

#include <cmath>

#include "integration/app/choice/quantity.h"
#include "tests/support/require.h"

namespace palpate::studies::fuzz {
void parse_quantity_bytes(std::string_view bytes) {
  const std::string text(bytes);
  for (const auto& found : {app::parse_seconds(text), app::parse_millimetres(text)}) {
    if (found)
      require(std::isfinite(*found) && *found > 0.0, "it is a number above zero");
    else
      require(found.error().message.ends_with("."), "a refusal is a sentence");
  }
}

}  // namespace palpate::studies::fuzz
