#include "module/haptics/modes/modes.h"

namespace palpate {

ModeKinds::ModeKinds() {
  add("surface", make_surface);
  add("follow", make_follow);
  add("front", make_front);
  add("vortex", make_follow);
  add("gradient-force", make_force);
  add("vector-force", make_force);
  add("attractor", make_attractor);
  add("tissue", make_tissue);
  add("viscosity", make_viscosity);
}

std::vector<std::string> ModeKinds::names() const {
  std::vector<std::string> names;
  for (const auto& [name, make] : kinds_) names.push_back(name);
  return names;
}

ModeSpec ModeKinds::completed(ModeSpec spec) {
  if (spec.kind == "surface" || spec.kind == "gradient-force" || spec.kind == "tissue")
    spec.vector = VectorProperty::kGradient;
  if (spec.kind == "vortex") spec.vector = VectorProperty::kCurl;
  return spec;
}

Result<std::shared_ptr<const Mode>> ModeKinds::make(const ModeSpec& spec) const {
  if (const auto kind = kinds_.find(spec.kind); kind != kinds_.end())
    return kind->second(completed(spec));
  std::string known;
  for (const auto& [name, make] : kinds_) known += (known.empty() ? "" : ", ") + name;
  return Error{ErrorKind::kBadInput, "Mode \"" + spec.name + "\" is of kind \"" + spec.kind +
                                         "\", which is not known: use one of " + known + "."};
}

}  // namespace palpate
