#include "integration/web/embedded.h"

// Windows' assembler names constants otherwise, and remembers no section.
#ifdef _WIN32
#define PALPATE_CONSTANTS ".section .rdata,\"dr\"\n"
#define PALPATE_AS_BEFORE ".text\n"
#else
#define PALPATE_CONSTANTS ".pushsection .rodata\n"
#define PALPATE_AS_BEFORE ".popsection\n"
#endif

// The assembler puts the bytes of a file between two names.
#define PALPATE_EMBED(name, file)                       \
  __asm__(PALPATE_CONSTANTS ".globl " name "\n" name    \
                            ":\n"                       \
                            ".incbin \"" file           \
                            "\"\n"                      \
                            ".globl " name "End\n" name \
                            "End:\n"                    \
                            ".byte 0\n" PALPATE_AS_BEFORE)

PALPATE_EMBED("kPalpateWebStyle", PALPATE_WEB_STYLE);
PALPATE_EMBED("kPalpateWebScript", PALPATE_WEB_SCRIPT);
PALPATE_EMBED("kPalpateWebLicences", PALPATE_WEB_LICENCES);
PALPATE_EMBED("kPalpateWebLivePage", PALPATE_WEB_LIVE_PAGE);
PALPATE_EMBED("kPalpateWebLiveStyle", PALPATE_WEB_LIVE_STYLE);
PALPATE_EMBED("kPalpateWebLiveScript", PALPATE_WEB_LIVE_SCRIPT);
PALPATE_EMBED("kPalpateWebLiveView", PALPATE_WEB_LIVE_VIEW);
#ifdef PALPATE_WEB_NIIVUE
PALPATE_EMBED("kPalpateWebNiiVue", PALPATE_WEB_NIIVUE);
#endif

extern "C" {
extern const char kPalpateWebStyle[], kPalpateWebStyleEnd[];
extern const char kPalpateWebScript[], kPalpateWebScriptEnd[];
extern const char kPalpateWebLicences[], kPalpateWebLicencesEnd[];
extern const char kPalpateWebLivePage[], kPalpateWebLivePageEnd[];
extern const char kPalpateWebLiveStyle[], kPalpateWebLiveStyleEnd[];
extern const char kPalpateWebLiveScript[], kPalpateWebLiveScriptEnd[];
extern const char kPalpateWebLiveView[], kPalpateWebLiveViewEnd[];
#ifdef PALPATE_WEB_NIIVUE
extern const char kPalpateWebNiiVue[], kPalpateWebNiiVueEnd[];
#endif
}

namespace palpate::web {

std::string_view embedded(Embedded file) {
  switch (file) {
    case Embedded::kStyle:
      return {kPalpateWebStyle, kPalpateWebStyleEnd};
    case Embedded::kScript:
      return {kPalpateWebScript, kPalpateWebScriptEnd};
    case Embedded::kLicences:
      return {kPalpateWebLicences, kPalpateWebLicencesEnd};
    case Embedded::kLivePage:
      return {kPalpateWebLivePage, kPalpateWebLivePageEnd};
    case Embedded::kLiveStyle:
      return {kPalpateWebLiveStyle, kPalpateWebLiveStyleEnd};
    case Embedded::kLiveScript:
      return {kPalpateWebLiveScript, kPalpateWebLiveScriptEnd};
    case Embedded::kLiveView:
      return {kPalpateWebLiveView, kPalpateWebLiveViewEnd};
    case Embedded::kNiiVue:
#ifdef PALPATE_WEB_NIIVUE
      return {kPalpateWebNiiVue, kPalpateWebNiiVueEnd};
#else
      break;
#endif
  }
  return {};
}

}  // namespace palpate::web
