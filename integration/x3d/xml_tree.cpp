#include "integration/x3d/xml_tree.h"

#include <expat.h>
#include <fmt/format.h>

#include <cstdint>
#include <limits>
#include <memory>

#include "integration/files/sentences.h"

namespace palpate::x3d {
namespace {

constexpr size_t kMostElements = 100'000;
constexpr size_t kDeepestElement = 64;

// The parser's line (from 1) and column (from 0): Expat 2.9 has new functions and warns of the old.
#if XML_MAJOR_VERSION * 100 + XML_MINOR_VERSION >= 209
uint64_t line_of(XML_Parser parser) {
  return XML_GetCurrentLineNumber64(parser);
}
uint64_t column_of(XML_Parser parser) {
  return XML_GetCurrentColumnNumber64(parser);
}
#else
uint64_t line_of(XML_Parser parser) {
  return XML_GetCurrentLineNumber(parser);
}
uint64_t column_of(XML_Parser parser) {
  return XML_GetCurrentColumnNumber(parser);
}
#endif

/// State shared by the handlers of one parse.
struct Parse {
  XML_Parser parser = nullptr;
  XmlTree tree;
  std::vector<size_t> open;  ///< the element that is being read, and its ancestors
  std::string refusal;       ///< why the parser was stopped

  void stop(std::string why) {
    if (refusal.empty()) refusal = std::move(why);
    XML_StopParser(parser, XML_FALSE);
  }
};

void XMLCALL on_start(void* user, const char* name, const char** attributes) {
  Parse& parse = *static_cast<Parse*>(user);
  // A stopped parser may still call a handler.
  if (!parse.refusal.empty()) return;
  if (parse.open.size() >= kDeepestElement)
    return parse.stop(fmt::format("nests elements more than {} deep: flatten it", kDeepestElement));
  if (parse.tree.size() >= kMostElements)
    return parse.stop(
        fmt::format("has more than {} elements: keep those to be felt", kMostElements));
  XmlElement element;
  element.name = name;
  element.line = int(line_of(parse.parser));
  for (size_t k = 0; attributes[k]; k += 2)
    element.attributes.emplace_back(attributes[k], attributes[k + 1]);
  if (!parse.open.empty()) parse.tree[parse.open.back()].children.push_back(parse.tree.size());
  parse.open.push_back(parse.tree.size());
  parse.tree.push_back(std::move(element));
}

void XMLCALL on_end(void* user, const char*) {
  Parse& parse = *static_cast<Parse*>(user);
  if (!parse.open.empty()) parse.open.pop_back();
}

void XMLCALL on_entity(void* user, const char* name, int, const char*, int, const char*,
                       const char*, const char*, const char*) {
  static_cast<Parse*>(user)->stop(
      fmt::format("declares the entity '{}', which could grow without bound: write out what it "
                  "stands for",
                  std::string_view(name).substr(0, 60)));
}

}  // namespace

const std::string* XmlElement::find(std::string_view attribute) const {
  for (const auto& [key, value] : attributes)
    if (key == attribute) return &value;
  return nullptr;
}

Result<XmlTree> parse_xml(const std::filesystem::path& file, std::string_view text) {
  const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                       XML_ParserFree);
  if (!parser || text.size() > size_t(std::numeric_limits<int>::max()))
    return files::bad_input(file, "is too large to be a scene: name an X3D file.");
  Parse parse;
  parse.parser = parser.get();
  XML_SetUserData(parser.get(), &parse);
  XML_SetElementHandler(parser.get(), on_start, on_end);
  XML_SetEntityDeclHandler(parser.get(), on_entity);
  const XML_Status status = XML_Parse(parser.get(), text.data(), int(text.size()), XML_TRUE);
  const uint64_t line = line_of(parser.get());
  if (!parse.refusal.empty())
    return files::bad_input(file, "can not be used at line {}: it {}.", line, parse.refusal);
  if (status != XML_STATUS_OK || parse.tree.empty())
    return files::bad_input(file, "is no XML at line {}, column {}: {}; correct it there.", line,
                            column_of(parser.get()) + 1,
                            XML_ErrorString(XML_GetErrorCode(parser.get())));
  return std::move(parse.tree);
}

}  // namespace palpate::x3d
