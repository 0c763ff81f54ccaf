#include "tests/lab/bench/settings_by_name.h"

#include <cstdlib>
#include <functional>
#include <map>
#include <sstream>

#include "tests/lab/bench/tools.h"

namespace palpate::bench {
namespace {

using Set = std::function<void(MotionOptions&, double)>;

template <class T>
Set number(T MotionOptions::*member) {
  return [member](MotionOptions& o, double value) { o.*member = T(value); };
}

std::map<std::string, Set> all_names() {
  std::map<std::string, Set> names = {
      {"damping", number(&MotionOptions::damping)},
      {"momentum", number(&MotionOptions::momentum)},
      {"largest_step", number(&MotionOptions::largest_step)},
      {"huber_mm", number(&MotionOptions::huber_mm)},
      {"filter_steps", number(&MotionOptions::filter_steps)},
      {"checkerboard", number(&MotionOptions::checkerboard)},
      {"normalise_window", number(&MotionOptions::normalise_window)},
      {"noise", number(&MotionOptions::noise)},
      {"converged", number(&MotionOptions::converged)},
      {"structure", number(&MotionOptions::structure)},
      {"search_above", number(&MotionOptions::search_above)},
      {"search_reach", number(&MotionOptions::search_reach)},
      {"search_mm", number(&MotionOptions::search_mm)},
      {"search_work", number(&MotionOptions::search_work)},
  };
  const auto part = [&](const std::string& prefix, auto of, auto... members) {
    const auto add = [&](const char* name, auto member) {
      names[prefix + name] = [of, member](MotionOptions& o, double value) {
        auto& to = o.*of.*member;
        to = std::remove_reference_t<decltype(to)>(value);
      };
    };
    (add(members.first, members.second), ...);
  };
  using Y = YieldOptions;
  part("yield_", &MotionOptions::yield, std::pair("window", &Y::window), std::pair("low", &Y::low),
       std::pair("high", &Y::high), std::pair("damping", &Y::damping),
       std::pair("smoothness", &Y::smoothness), std::pair("evidence", &Y::evidence),
       std::pair("noise", &Y::noise), std::pair("flat", &Y::flat),
       std::pair("choose_after", &Y::choose_after), std::pair("gain_low", &Y::gain_low),
       std::pair("gain_high", &Y::gain_high));
  using S = SlidingOptions;
  part("sliding_", &MotionOptions::sliding, std::pair("cell", &S::cell),
       std::pair("cubic", &S::cubic), std::pair("limit", &S::limit), std::pair("share", &S::share),
       std::pair("noise", &S::noise), std::pair("apart", &S::apart), std::pair("slope", &S::slope));
  for (size_t l = 0; l < 3; ++l) {
    const auto level = [&](const char* name, auto member) {
      names[name + std::to_string(l)] = [l, member](MotionOptions& o, double value) {
        auto& to = o.levels.at(std::min(l, o.levels.size() - 1)).*member;
        to = std::remove_reference_t<decltype(to)>(value);
      };
    };
    level("iterations", &LevelOptions::iterations);
    level("cell", &LevelOptions::cell);
    level("window", &LevelOptions::window);
    level("smoothness", &LevelOptions::smoothness);
    level("second", &LevelOptions::second);
  }
  return names;
}

}  // namespace

void change(MotionOptions& options, const std::string& settings) {
  static const std::map<std::string, Set> names = all_names();
  std::istringstream words(settings);
  for (std::string word; words >> word;) {
    const size_t equals = word.find('=');
    const auto name = names.find(word.substr(0, equals));
    char* end = nullptr;
    const std::string text = equals == std::string::npos ? "" : word.substr(equals + 1);
    const double value = std::strtod(text.c_str(), &end);
    if (name == names.end() || text.empty() || *end != '\0') {
      std::string known;
      for (const auto& [each, set] : names) known += " " + each;
      throw Mismatch("\"" + word + "\" is no setting: write NAME=NUMBER with one of" + known + ".");
    }
    name->second(options, value);
  }
}

}  // namespace palpate::bench
