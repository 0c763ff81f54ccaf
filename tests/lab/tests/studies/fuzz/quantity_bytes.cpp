#include "tests/lab/tests/studies/fuzz/quantity_bytes.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "integration/app/choice/quantity.h"

namespace palpate::studies::fuzz {
namespace {

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken promise of the reader of quantities: %s\n", what);
  std::abort();
}

}  // namespace

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
