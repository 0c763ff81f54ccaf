#include "module/view/letters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace palpate {
namespace {

constexpr double kApart = 1.1;    // heights from the box to the middle of a letter
constexpr double kAround = 0.6;   // heights from the middle of a letter to its border, and a little
constexpr double kAdvance = 0.9;  // heights from one letter to the next

using Stroke = std::vector<glm::dvec2>;

/// The strokes of a letter, x to the right and y up, one unit high around the origin.
std::vector<Stroke> strokes_of(char letter) {
  const Stroke bowl{{-0.28, 0.5}, {0.06, 0.5}, {0.2, 0.46}, {0.28, 0.36}, {0.3, 0.25},
                    {0.28, 0.14}, {0.2, 0.04}, {0.06, 0.0}, {-0.28, 0.0}};
  switch (letter) {
    case 'L':
      return {{{-0.26, 0.5}, {-0.26, -0.5}, {0.3, -0.5}}};
    case 'R':
      return {{{-0.28, -0.5}, {-0.28, 0.5}}, bowl, {{0.02, 0.0}, {0.32, -0.5}}};
    case 'P':
      return {{{-0.28, -0.5}, {-0.28, 0.5}}, bowl};
    case 'A':
      return {{{-0.36, -0.5}, {0.0, 0.5}, {0.36, -0.5}}, {{-0.23, -0.15}, {0.23, -0.15}}};
    case 'S':
      return {{{0.28, 0.34},
               {0.2, 0.45},
               {0.06, 0.5},
               {-0.1, 0.5},
               {-0.23, 0.44},
               {-0.28, 0.31},
               {-0.25, 0.16},
               {-0.14, 0.06},
               {0.12, -0.04},
               {0.25, -0.13},
               {0.3, -0.27},
               {0.26, -0.4},
               {0.12, -0.49},
               {-0.06, -0.5},
               {-0.21, -0.45},
               {-0.3, -0.33}}};
    default:
      return {
          {{0.0, 0.5}, {0.0, -0.5}}, {{-0.16, 0.5}, {0.16, 0.5}}, {{-0.16, -0.5}, {0.16, -0.5}}};
  }
}

/// Where an eye sees a place: tangents, and the depth along its axis.
glm::dvec3 seen_from(const Eye& eye, glm::dvec3 at) {
  const glm::dvec3 from_eye = glm::conjugate(eye.orientation) * (at - eye.position_m);
  return {glm::dvec2(from_eye) / std::max(-from_eye.z, 1e-9), -from_eye.z};
}

/// A box as an eye sees it: corners by bits (x, y, z: 1 at the high side), as tangents.
struct SeenBox {
  std::array<glm::dvec3, 8> corners_m;  ///< world
  std::array<glm::dvec2, 8> seen;
  std::array<bool, 3> is_flat;  ///< along x, y, z: both faces are one
  std::vector<int> outline;     ///< corners around it, counter-clockwise; empty: there is none

  bool has(int axis, int side, int corner) const {
    return is_flat[size_t(axis)] || (corner >> axis & 1) == side;
  }
  /// Away from the box, from its outline between two corners that follow each other.
  glm::dvec2 outwards(int from, int to) const {
    const glm::dvec2 way = seen[size_t(to)] - seen[size_t(from)];
    return glm::normalize(glm::dvec2(way.y, -way.x));
  }
  int around(size_t k) const { return outline[k % outline.size()]; }
};

SeenBox seen_box(const Transform& world_from_volume, const DataBox& given, const Eye& eye) {
  SeenBox box;
  bool in_front = true;
  for (int a = 0; a < 3; ++a) box.is_flat[size_t(a)] = !(given.edges_m[a] > 0.0);
  for (int c = 0; c < 8; ++c) {
    box.corners_m[size_t(c)] = world_from_volume.world_from_volume(given.corner(c));
    const glm::dvec3 seen = seen_from(eye, box.corners_m[size_t(c)]);
    box.seen[size_t(c)] = glm::dvec2(seen);
    in_front = in_front && seen.z > 0.0;
  }
  if (!in_front) return box;

  // Jarvis's march from the leftmost corner: each next one has all others at its left, and is the
  // furthest of those in one line.
  int at = 0;
  for (int c = 1; c < 8; ++c)
    if (box.seen[size_t(c)].x < box.seen[size_t(at)].x) at = c;
  const glm::dvec2 start = box.seen[size_t(at)];
  do {
    box.outline.push_back(at);
    int next = -1;
    glm::dvec2 to_next(0.0);
    for (int c = 0; c < 8; ++c) {
      const glm::dvec2 way = box.seen[size_t(c)] - box.seen[size_t(at)];
      if (way == glm::dvec2(0.0)) continue;
      const double left = to_next.x * way.y - to_next.y * way.x;
      const bool is_further = glm::length(way) > glm::length(to_next);
      if (next < 0 || left < 0.0 || (left == 0.0 && is_further)) next = c, to_next = way;
    }
    at = next;
  } while (at >= 0 && box.seen[size_t(at)] != start && box.outline.size() < 8);
  // Seen as a line or a point it has no outline.
  if (box.outline.size() < 3) box.outline.clear();
  return box;
}

/// The letters of a face.
struct SideLetters {
  int axis, side;
  std::string text;
  glm::dvec3 at{0.0};      ///< of their middle: before that of the face, until they have a place
  bool has_place = false;  ///< they are where they can be

  /// How much farther they reach to either side than one letter, heights.
  double wider() const { return 0.5 * kAdvance * (double(text.size()) - 1.0); }
};

/// Whether letters at a place are beside the outline, and do not stand before the box or behind it.
bool is_beside(const SeenBox& box, const SideLetters& letters, glm::dvec3 seen, double height_m) {
  const double height = height_m / seen.z;
  double outside = std::numeric_limits<double>::lowest();
  for (size_t k = 0; k < box.outline.size(); ++k) {
    const int from = box.around(k), to = box.around(k + 1);
    const glm::dvec2 out = box.outwards(from, to);
    const double reach = letters.wider() * std::abs(out.x) * height;
    outside = std::max(outside, glm::dot(glm::dvec2(seen) - box.seen[size_t(from)], out) - reach);
  }
  return outside > kAround * height;
}

/// Where letters can stand: beside an edge of the outline, or beside a corner: the same one twice.
struct LetterPlace {
  glm::dvec3 on_outline;
  glm::dvec2 out;   ///< to the eye's right, and up
  double sideways;  ///< how much farther out, for each height that letters reach to their sides
  int from, to;
  bool is_taken = false;
};

std::vector<LetterPlace> places_beside(const SeenBox& box) {
  std::vector<LetterPlace> places;
  for (size_t k = 0; k < box.outline.size(); ++k) {
    const int before = box.around(k), here = box.around(k + 1), after = box.around(k + 2);
    const glm::dvec3 corner = box.corners_m[size_t(here)];
    const glm::dvec2 out_before = box.outwards(before, here), out = box.outwards(here, after);
    places.push_back(
        {0.5 * (corner + box.corners_m[size_t(after)]), out, std::abs(out.x), here, after});
    // Beyond one of the corner's edges, whichever is nearer.
    if (!(glm::length(out_before + out) > 1e-6)) continue;
    const glm::dvec2 between = glm::normalize(out_before + out);
    const double sideways = std::min(std::abs(out_before.x) / glm::dot(out_before, between),
                                     std::abs(out.x) / glm::dot(out, between));
    places.push_back({corner, between, sideways, here, here});
  }
  return places;
}

/// Whether letters at two places cover each other, as an eye sees them.
bool overlap(const SideLetters& a, glm::dvec3 seen_a, const SideLetters& b, glm::dvec3 seen_b,
             double height_m) {
  const double height = height_m / std::min(seen_a.z, seen_b.z);
  return std::abs(seen_a.x - seen_b.x) < (2.0 * kAround + a.wider() + b.wider()) * height &&
         std::abs(seen_a.y - seen_b.y) < 2.0 * kAround * height;
}

/// The free places of a face's letters: how many, and the one that is seen nearest to it.
struct FreePlaces {
  int count = 0;
  LetterPlace* nearest = nullptr;
};

/// Puts letters beside a box, for one eye.
class LetterPlacer {
 public:
  LetterPlacer(std::vector<SideLetters>& faces, const SeenBox& box, const Eye& eye, double height_m)
      : faces_(faces), box_(box), eye_(eye), height_m_(height_m), places_(places_beside(box)) {}

  /// Gives the letters without a place one at an edge of the outline, or else at a corner of it:
  /// where they cover no others, if there is such a place. The face with the fewest edges to choose
  /// from is the next.
  void run() {
    for (size_t k = 0; k < faces_.size(); ++k) {
      SideLetters* next = nullptr;
      FreePlaces of_next;
      for (SideLetters& letters : faces_) {
        if (letters.has_place) continue;
        const FreePlaces found = free_places(letters, false, true);
        if (!next || found.count < of_next.count) next = &letters, of_next = found;
      }
      if (!next) return;
      for (const bool alone : {true, false})
        for (const bool corners : {false, true})
          if (of_next.count == 0) of_next = free_places(*next, corners, alone);
      next->has_place = true;
      if (!of_next.nearest) {
        // A face behind the box, seen straight: its letters would stand before or behind the data.
        next->text.clear();
        continue;
      }
      of_next.nearest->is_taken = true;
      next->at = middle_at(*of_next.nearest, *next);
    }
  }

 private:
  FreePlaces free_places(const SideLetters& letters, bool corners, bool alone) {
    FreePlaces found;
    double least = 0.0;
    for (LetterPlace& place : places_) {
      if (place.is_taken || (place.from == place.to) != corners ||
          !box_.has(letters.axis, letters.side, place.from) ||
          !box_.has(letters.axis, letters.side, place.to))
        continue;
      const glm::dvec3 seen = seen_from(eye_, middle_at(place, letters));
      if (alone && covers_others(letters, seen)) continue;
      const double apart = glm::distance(glm::dvec2(seen), glm::dvec2(seen_from(eye_, letters.at)));
      if (found.count++ == 0 || apart < least) found.nearest = &place, least = apart;
    }
    return found;
  }
  bool covers_others(const SideLetters& letters, glm::dvec3 seen) const {
    return std::any_of(faces_.begin(), faces_.end(), [&](const SideLetters& other) {
      return other.has_place && overlap(letters, seen, other, seen_from(eye_, other.at), height_m_);
    });
  }
  glm::dvec3 middle_at(const LetterPlace& place, const SideLetters& letters) const {
    const glm::dvec3 way = eye_.orientation * glm::dvec3(place.out, 0.0);
    return place.on_outline + (kApart + letters.wider() * place.sideways) * height_m_ * way;
  }

  std::vector<SideLetters>& faces_;
  const SeenBox& box_;
  const Eye& eye_;
  double height_m_;
  std::vector<LetterPlace> places_;
};

/// How far letters come in that the border of an eye's picture would cut, by their height at most:
/// in the world.
glm::dvec3 inwards(const SideLetters& letters, const Eye& eye, double height_m) {
  const glm::dvec3 seen = seen_from(eye, letters.at);
  if (seen.z <= 0.0) return glm::dvec3(0.0);
  const auto along = [&](double tangent, double low, double high, double around) {
    const double half = around * height_m / seen.z;
    const double within = std::clamp(tangent, low + half, std::max(high - half, low + half));
    return std::clamp((within - tangent) * seen.z, -height_m, height_m);
  };
  return eye.orientation *
         glm::dvec3(along(seen.x, eye.tan_left, eye.tan_right, kAround + letters.wider()),
                    along(seen.y, eye.tan_down, eye.tan_up, kAround), 0.0);
}

}  // namespace

void add_letters(Things& things, const Transform& world_from_volume, const DataBox& box,
                 std::span<const Eye> eyes, double height_m, glm::dvec3 colour) {
  const Eye& eye = eyes[0];
  const glm::dvec3 right = eye.orientation * glm::dvec3(1.0, 0.0, 0.0);
  const glm::dvec3 up = eye.orientation * glm::dvec3(0.0, 1.0, 0.0);
  const SeenBox seen = seen_box(world_from_volume, box, eye);

  // Before the middle of its face, where that is seen beside the box.
  std::vector<SideLetters> faces;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      glm::dvec3 share(0.5);
      share[axis] = side;
      const glm::dvec3 way = side ? box.axes[axis] : -box.axes[axis];
      const glm::dvec3 out = world_from_volume.rotation * way;
      SideLetters letters{axis, side, side_of(way)};
      letters.at = world_from_volume.world_from_volume(box.at(share)) +
                   (kApart + letters.wider() * std::abs(glm::dot(out, right))) * height_m * out;
      letters.has_place =
          seen.outline.empty() || is_beside(seen, letters, seen_from(eye, letters.at), height_m);
      faces.push_back(std::move(letters));
    }
  LetterPlacer(faces, seen, eye, height_m).run();
  for (SideLetters& letters : faces) {
    for (const Eye& seeing : eyes) letters.at += inwards(letters, seeing, height_m);
    for (size_t n = 0; n < letters.text.size(); ++n) {
      const double before = kAdvance * double(n) - letters.wider();
      const auto at = [&](glm::dvec2 p) {
        return letters.at + height_m * ((p.x + before) * right + p.y * up);
      };
      for (const Stroke& stroke : strokes_of(letters.text[n]))
        for (size_t k = 1; k < stroke.size(); ++k) {
          const double radius_m = 0.07 * height_m;
          things.push_back({at(stroke[k - 1]), at(stroke[k]), radius_m, radius_m, colour});
        }
    }
  }
}

}  // namespace palpate
