#include "module/view/letters.h"

#include <algorithm>
#include <array>
#include <limits>

namespace palpate {
namespace {

constexpr double kApart = 1.1;   // heights from the box to the middle of a letter
constexpr double kAround = 0.6;  // heights from the middle of a letter to its border, and a little
constexpr char kLetters[3][2] = {{'R', 'L'}, {'I', 'S'}, {'P', 'A'}};

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

SeenBox seen_box(const Transform& world_from_volume, glm::dvec3 low_m, glm::dvec3 high_m,
                 const Eye& eye) {
  SeenBox box;
  bool in_front = true;
  for (int a = 0; a < 3; ++a) box.is_flat[size_t(a)] = !(low_m[a] < high_m[a]);
  for (int c = 0; c < 8; ++c) {
    const glm::dvec3 end(c & 1, c >> 1 & 1, c >> 2);
    box.corners_m[size_t(c)] = world_from_volume.world_from_volume(glm::mix(low_m, high_m, end));
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

/// Whether a letter is beside the outline, and does not stand before the box or behind it.
bool is_beside(const SeenBox& box, glm::dvec3 seen, double height_m) {
  double outside = std::numeric_limits<double>::lowest();
  for (size_t k = 0; k < box.outline.size(); ++k) {
    const int from = box.around(k), to = box.around(k + 1);
    outside = std::max(outside,
                       glm::dot(glm::dvec2(seen) - box.seen[size_t(from)], box.outwards(from, to)));
  }
  return outside > kAround * height_m / seen.z;
}

/// A place beside an edge of the outline, or beside a corner: the same one twice.
struct LetterPlace {
  glm::dvec3 at;
  int from, to;
  bool is_taken = false;
};

/// right, up: of the eye, as long as a letter is away from the box.
std::vector<LetterPlace> places_beside(const SeenBox& box, glm::dvec3 right, glm::dvec3 up) {
  std::vector<LetterPlace> places;
  const auto moved = [&](glm::dvec3 at, glm::dvec2 out) { return at + out.x * right + out.y * up; };
  for (size_t k = 0; k < box.outline.size(); ++k) {
    const int before = box.around(k), here = box.around(k + 1), after = box.around(k + 2);
    const glm::dvec3 corner = box.corners_m[size_t(here)];
    const glm::dvec2 out = box.outwards(here, after);
    places.push_back({moved(0.5 * (corner + box.corners_m[size_t(after)]), out), here, after});
    places.push_back({moved(corner, glm::normalize(box.outwards(before, here) + out)), here, here});
  }
  return places;
}

/// A side's letter.
struct SideLetter {
  int axis, side;
  glm::dvec3 at;           ///< before the middle of its face, until it has a place
  bool has_place = false;  ///< it is where it can be
};

/// The free places of a letter's face: how many, and the one that is seen nearest to it.
struct FreePlaces {
  int count = 0;
  LetterPlace* nearest = nullptr;
};
FreePlaces free_places(const SideLetter& letter, std::vector<LetterPlace>& places, bool corners,
                       const SeenBox& box, const Eye& eye) {
  FreePlaces found;
  double least = 0.0;
  for (LetterPlace& place : places) {
    if (place.is_taken || (place.from == place.to) != corners ||
        !box.has(letter.axis, letter.side, place.from) ||
        !box.has(letter.axis, letter.side, place.to))
      continue;
    const double apart =
        glm::distance(glm::dvec2(seen_from(eye, place.at)), glm::dvec2(seen_from(eye, letter.at)));
    if (found.count++ == 0 || apart < least) found.nearest = &place, least = apart;
  }
  return found;
}

/// Gives the letters without a place one at an edge of the outline, or else at a corner of it. The
/// one with the fewest edges to choose from is the next.
void give_places(std::vector<SideLetter>& letters, std::vector<LetterPlace> places,
                 const SeenBox& box, const Eye& eye) {
  for (size_t k = 0; k < letters.size(); ++k) {
    SideLetter* next = nullptr;
    FreePlaces of_next;
    for (SideLetter& letter : letters) {
      if (letter.has_place) continue;
      const FreePlaces found = free_places(letter, places, false, box, eye);
      if (!next || found.count < of_next.count) next = &letter, of_next = found;
    }
    if (!next) return;
    if (of_next.count == 0) of_next = free_places(*next, places, true, box, eye);
    next->has_place = true;
    if (!of_next.nearest) continue;
    of_next.nearest->is_taken = true;
    next->at = of_next.nearest->at;
  }
}

/// How far a letter comes in that the border of the picture would cut: by its height at most.
glm::dvec2 inwards(glm::dvec3 seen, const Eye& eye, double height_m) {
  if (seen.z <= 0.0) return glm::dvec2(0.0);
  const double half = kAround * height_m / seen.z;
  const auto along = [&](double tangent, double low, double high) {
    const double within = std::clamp(tangent, low + half, std::max(high - half, low + half));
    return std::clamp((within - tangent) * seen.z, -height_m, height_m);
  };
  return {along(seen.x, eye.tan_left, eye.tan_right), along(seen.y, eye.tan_down, eye.tan_up)};
}

}  // namespace

void add_letters(Things& things, const Transform& world_from_volume, glm::dvec3 low_m,
                 glm::dvec3 high_m, const Eye& eye, double height_m, glm::dvec3 colour) {
  const glm::dvec3 right = eye.orientation * glm::dvec3(1.0, 0.0, 0.0);
  const glm::dvec3 up = eye.orientation * glm::dvec3(0.0, 1.0, 0.0);
  const SeenBox box = seen_box(world_from_volume, low_m, high_m, eye);

  // Before the middle of its face, where that is seen beside the box.
  std::vector<SideLetter> letters;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      glm::dvec3 middle = 0.5 * (low_m + high_m), out(0.0);
      middle[axis] = side ? high_m[axis] : low_m[axis];
      out[axis] = side ? kApart * height_m : -kApart * height_m;
      const glm::dvec3 at =
          world_from_volume.world_from_volume(middle) + world_from_volume.rotation * out;
      const bool has_place = box.outline.empty() || is_beside(box, seen_from(eye, at), height_m);
      letters.push_back({axis, side, at, has_place});
    }
  give_places(letters, places_beside(box, kApart * height_m * right, kApart * height_m * up), box,
              eye);
  for (const SideLetter& letter : letters) {
    const glm::dvec2 in = inwards(seen_from(eye, letter.at), eye, height_m);
    const auto at = [&](glm::dvec2 p) {
      return letter.at + (height_m * p.x + in.x) * right + (height_m * p.y + in.y) * up;
    };
    for (const Stroke& stroke : strokes_of(kLetters[letter.axis][letter.side]))
      for (size_t k = 1; k < stroke.size(); ++k) {
        const double radius_m = 0.07 * height_m;
        things.push_back({at(stroke[k - 1]), at(stroke[k]), radius_m, radius_m, colour});
      }
  }
}

}  // namespace palpate
