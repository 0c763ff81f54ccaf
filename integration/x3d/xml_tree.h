#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::x3d {

/// One element of an XML file. Text between elements is not kept: X3D has none that matters here.
struct XmlElement {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;  ///< as they stand, UTF-8
  std::vector<size_t> children;                                 ///< indices into the tree
  int line = 0;

  /// The value of an attribute, or null.
  const std::string* find(std::string_view attribute) const;
};

/// All elements in the order in which they begin; the root is the first.
using XmlTree = std::vector<XmlElement>;

/// kBadInput, in one sentence that names the line: what is no XML, entities that the file declares
/// (they can grow without bound), elements more than 64 deep and more than 100,000 of them. Fetches
/// nothing: a DOCTYPE is only passed over. `file` is for sentences. Any thread.
Result<XmlTree> parse_xml(const std::filesystem::path& file, std::string_view text);

}  // namespace palpate::x3d
