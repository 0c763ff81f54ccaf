#include "tests/xr/runtime/profiles.h"

#include <map>
#include <set>

namespace palpate::test::fake {
namespace {

struct Parts {
  std::set<std::string> both, left, right;
};

const std::map<std::string, Parts>& table() {
  // Identifiers without a component stand for the usual one (".../trigger" for
  // ".../trigger/value").
  static const std::map<std::string, Parts> all{
      {"/interaction_profiles/khr/simple_controller",
       {{"select/click", "menu/click", "select", "menu"}, {}, {}}},
      {"/interaction_profiles/oculus/touch_controller",
       {{"squeeze/value", "squeeze", "trigger/value", "trigger", "trigger/touch", "thumbstick",
         "thumbstick/x", "thumbstick/y", "thumbstick/click", "thumbstick/touch", "thumbrest/touch"},
        {"x/click", "x/touch", "y/click", "y/touch", "menu/click"},
        {"a/click", "a/touch", "b/click", "b/touch", "system/click"}}},
      {"/interaction_profiles/htc/vive_controller",
       {{"system/click", "squeeze/click", "menu/click", "trigger/click", "trigger/value", "trigger",
         "trackpad", "trackpad/x", "trackpad/y", "trackpad/click", "trackpad/touch"},
        {},
        {}}},
      {"/interaction_profiles/valve/index_controller",
       {{"system/click",  "system/touch",     "a/click",          "a/touch",    "b/click",
         "b/touch",       "squeeze/value",    "squeeze/force",    "squeeze",    "trigger/click",
         "trigger/value", "trigger/touch",    "trigger",          "thumbstick", "thumbstick/x",
         "thumbstick/y",  "thumbstick/click", "thumbstick/touch", "trackpad",   "trackpad/x",
         "trackpad/y",    "trackpad/force",   "trackpad/touch"},
        {},
        {}}},
      {"/interaction_profiles/microsoft/motion_controller",
       {{"menu/click", "squeeze/click", "trigger/value", "trigger", "thumbstick", "thumbstick/x",
         "thumbstick/y", "thumbstick/click", "trackpad", "trackpad/x", "trackpad/y",
         "trackpad/click", "trackpad/touch"},
        {},
        {}}},
      // Without haptics. Its poses are valid in every profile where the extension is enabled; no
      // test needs them there.
      {"/interaction_profiles/ext/hand_interaction_ext",
       {{"pinch_ext/pose", "poke_ext/pose", "pinch_ext/value", "pinch_ext/ready_ext",
         "aim_activate_ext/value", "aim_activate_ext/ready_ext", "grasp_ext/value",
         "grasp_ext/ready_ext"},
        {},
        {}}}};
  return all;
}

}  // namespace

bool is_profile(const std::string& profile) {
  return table().count(profile) > 0;
}

bool has_part(const std::string& profile, const std::string& path) {
  const auto parts = table().find(profile);
  if (parts == table().end()) return false;
  const std::string left = "/user/hand/left/", right = "/user/hand/right/";
  const bool is_left = path.rfind(left, 0) == 0, is_right = path.rfind(right, 0) == 0;
  if (!is_left && !is_right) return false;
  const std::string rest = path.substr((is_left ? left : right).size());
  for (const char* common :
       {"input/grip/pose", "input/aim/pose", "output/haptic", "input/grip", "input/aim"})
    if (rest == common)
      return rest != "output/haptic" || profile.rfind("/interaction_profiles/ext/", 0) != 0;
  if (rest.rfind("input/", 0) != 0) return false;
  const std::string part = rest.substr(6);
  const Parts& has = parts->second;
  return has.both.count(part) || (is_left ? has.left : has.right).count(part);
}

}  // namespace palpate::test::fake
