#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::x3d {

/// One element of an XML file. Text between elements is dropped: in X3D it does not matter.
struct XmlElement {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;  ///< unchanged, UTF-8
  std::vector<size_t> children;                                 ///< indices into the tree
  int line = 0;

  /// The value of an attribute, or null.
  const std::string* find(std::string_view attribute) const;
};

/// All elements in the order in which they begin; the root is the first.
using XmlTree = std::vector<XmlElement>;

/// Parses XML. Errors: kBadInput, with one sentence that names the line: not XML, entities declared
/// in the file (they can grow without bound), elements more than 64 deep, more than 100,000
/// elements. Downloads nothing: a DOCTYPE is skipped. `file` is used in messages. Any thread.
Result<XmlTree> parse_xml(const std::filesystem::path& file, std::string_view text);

}  // namespace palpate::x3d
