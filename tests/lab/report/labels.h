#pragma once

#include <string>
#include <vector>

/// Places of names beside their marks.
namespace palpate::report {

/// A mark in the picture, px from the left and the bottom, and its name (empty: the mark only takes
/// space).
struct Tag {
  double x = 0.0, y = 0.0;
  std::string text;
};

/// A name's place: its lower left corner in px; absent if there was no space.
struct Placed {
  size_t tag = 0;
  double x = 0.0, y = 0.0;
};

/// Places names right, left, above or below their marks, at the first place that covers no mark and
/// no name and is within the picture. A name without space is left out: it is still in the tool tip
/// and the table. In the order of the tags, so the more important ones should come first.
std::vector<Placed> placed_labels(const std::vector<Tag>& tags, double left, double right,
                                  double bottom, double top);

}  // namespace palpate::report
