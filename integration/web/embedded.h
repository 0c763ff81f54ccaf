#pragma once

#include <string_view>

namespace palpate::web {

/// Files that are inside the program, as they are beside this one (NiiVue: as its package has it).
enum class Embedded {
  kStyle,
  kScript,
  kLicences,
  kNiiVue,
  kLivePage,
  kLiveStyle,
  kLiveScript,
  kLiveView
};

/// The bytes of a file; empty if the program was built without it.
std::string_view embedded(Embedded file);

}  // namespace palpate::web
