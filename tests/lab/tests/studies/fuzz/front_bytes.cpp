#include "tests/lab/tests/studies/fuzz/front_bytes.h"

#include <cmath>

#include "integration/app/choice/motion_front.h"
#include "tests/support/require.h"

namespace palpate::studies::fuzz {
void parse_front_bytes(std::string_view bytes) {
  const auto front = app::parse_front(std::string(bytes));
  if (!front) {
    require(front.error().message.find("palpate chart motion") != std::string::npos,
            "an error says what to run");
    return;
  }
  require(front->voxels > 0 && !front->points.empty(), "there is something to choose from");
  for (const app::FrontPoint& point : front->points) {
    require(std::isfinite(point.seconds) && point.seconds > 0.0, "settings take time");
    require(std::isfinite(point.error_voxels) && point.error_voxels >= 0.0, "errors are numbers");
  }
  for (const double wish : {1e-9, 1.0, 1e9}) {
    std::vector<app::Choice> choices;
    const auto refused = [](const Error& error) {
      require(error.message.ends_with("."), "a refusal is a sentence");
    };
    if (const auto one = app::choose_within(*front, wish, 1000000, 1.0)) {
      choices.push_back(*one);
    } else {
      refused(one.error());
    }
    if (const auto more = app::choose_by_error(*front, wish, 1000000, 1.0)) {
      require(!more->empty(), "a choice is one");
      choices.insert(choices.end(), more->begin(), more->end());
    } else {
      refused(more.error());
    }
    for (const app::Choice& choice : choices) {
      require(app::motion_setting(choice.setting.name).has_value(), "what is chosen exists");
      require(std::isfinite(choice.expected_s), "what is expected is a number");
    }
  }
}

}  // namespace palpate::studies::fuzz
