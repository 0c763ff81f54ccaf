#pragma once

#include <string>
#include <vector>

/// Where names stand beside their marks.
namespace palpate::report {

/// A mark in the picture, px from the left and the bottom, and its name (empty: it only takes
/// room).
struct Tag {
  double x = 0.0, y = 0.0;
  std::string text;
};

/// A name's place: its lower left corner in px; absent where there was no room.
struct Placed {
  size_t tag = 0;
  double x = 0.0, y = 0.0;
};

/// Places names right, left, above or below their marks, the first that covers no mark and no name
/// and stays within the picture. A name without room is left out: it is still in the tool tip and
/// the table. In the order of the tags, so that the more important ones should come first.
std::vector<Placed> placed_labels(const std::vector<Tag>& tags, double left, double right,
                                  double bottom, double top);

}  // namespace palpate::report
