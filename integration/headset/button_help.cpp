#include "integration/headset/button_help.h"

#include <algorithm>
#include <array>

#include "module/xr/bindings.h"

namespace palpate::headset {
namespace {

using xr::Act;

/// "/user/hand/left/input/thumbstick/x": left, thumbstick, x.
struct PartOfController {
  std::string_view side, part, component;
};

PartOfController part_of(std::string_view path) {
  std::array<std::string_view, 7> words{};
  for (size_t n = 0; n < words.size() && !path.empty(); ++n) {
    path.remove_prefix(1);
    words[n] = path.substr(0, path.find('/'));
    path.remove_prefix(words[n].size());
  }
  return {words[2], words[4], words[5]};
}

/// As a person calls it: "A", "stick sideways".
std::string word_of(const PartOfController& of) {
  std::string word(of.part == "thumbstick" ? "stick" : of.part);
  if (word.size() == 1) word.front() = char(word.front() - 'a' + 'A');
  if (of.component == "x") word += " sideways";
  return word;
}

}  // namespace

std::vector<ButtonHelp> button_help(std::string_view profile, const std::string& trigger) {
  std::vector<ButtonHelp> lines;
  const auto all = xr::profiles();
  const auto own = std::find_if(all.begin(), all.end(),
                                [&](const xr::Profile& one) { return one.path == profile; });
  if (own == all.end()) return lines;
  for (const xr::ActSpec& act : xr::acts()) {
    if (act.kind == xr::ActKind::kPose || act.kind == xr::ActKind::kVibration) continue;
    const std::string does = act.act == Act::kDeadMan ? trigger : act.label;
    std::string where;
    int sides = 0;
    for (const xr::InputBinding& binding : own->bindings) {
      if (binding.act != act.act) continue;
      const PartOfController part = part_of(binding.path);
      where = ++sides == 1 ? std::string(part.side) + " " + word_of(part) : word_of(part);
    }
    if (sides > 0 && !does.empty()) lines.emplace_back(where, does);
  }
  return lines;
}

}  // namespace palpate::headset
