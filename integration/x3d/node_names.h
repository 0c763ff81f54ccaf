#pragma once

#include <string>
#include <string_view>

namespace palpate::x3d {

/// Nodes whose children are read as if they stood at the node's place.
bool is_group(std::string_view name);

/// The node that palpate reads and whose name is nearest to `name`, if that is probably a typing
/// error: one edit in five letters at most, in any case of letters. Empty for names that are read,
/// for other names of X3D, and where nothing is near.
std::string_view meant_node(std::string_view name);

}  // namespace palpate::x3d
