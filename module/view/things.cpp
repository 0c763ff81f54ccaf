#include "module/view/things.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "module/scene/field_line.h"

namespace palpate {
namespace {

void add_rod(Things& things, glm::dvec3 from, glm::dvec3 to, double radius_m, glm::dvec3 colour) {
  things.push_back({from, to, radius_m, radius_m, colour});
}

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

/// Blue over white to red, 0 to 1, sRGB.
glm::dvec3 heat(double share) {
  const glm::dvec3 cold(0.23, 0.45, 0.92), middle(0.93, 0.92, 0.88), hot(0.90, 0.26, 0.18);
  return share < 0.5 ? glm::mix(cold, middle, 2.0 * share)
                     : glm::mix(middle, hot, 2.0 * share - 1.0);
}

}  // namespace

void add_sphere(Things& things, glm::dvec3 centre, double radius_m, glm::dvec3 colour) {
  add_rod(things, centre, centre, radius_m, colour);
}

void add_pen(Things& things, glm::dvec3 tip, glm::dvec3 away, double radius_m, double length_m,
             glm::dvec3 colour) {
  const double shaft = 1.9 * radius_m, cone = std::min(9.0 * radius_m, 0.4 * length_m);
  things.push_back({tip, tip + cone * away, radius_m, shaft, colour});
  add_rod(things, tip + cone * away, tip + length_m * away, shaft, 0.55 * colour);
}

void add_arrow(Things& things, glm::dvec3 from, glm::dvec3 force_n, double m_per_n, double radius_m,
               glm::dvec3 colour) {
  const glm::dvec3 way = m_per_n * force_n;
  const double length = glm::length(way);
  if (!(length > 2.0 * radius_m)) return;
  const double head = std::min(6.0 * radius_m, 0.5 * length);
  const glm::dvec3 neck = from + way * (1.0 - head / length);
  add_rod(things, from, neck, radius_m, colour);
  things.push_back({neck, from + way, 2.4 * radius_m, 0.15 * radius_m, colour});
}

void add_box(Things& things, const Transform& world_from_volume, glm::dvec3 low_m,
             glm::dvec3 high_m, double radius_m, glm::dvec3 colour) {
  const auto corner = [&](int c) {
    const glm::dvec3 end(c & 1, c >> 1 & 1, c >> 2);
    return world_from_volume.world_from_volume(glm::mix(low_m, high_m, end));
  };
  for (int c = 0; c < 8; ++c)
    for (int axis = 0; axis < 3; ++axis)
      if (!(c >> axis & 1)) add_rod(things, corner(c), corner(c | 1 << axis), radius_m, colour);
}

namespace {

/// A box as an eye sees it: corners by bits (x, y, z: 1 at the high side), as tangents.
struct SeenBox {
  std::array<glm::dvec3, 8> corners_m;  ///< world
  std::array<glm::dvec2, 8> seen;
  std::vector<int>
      outline;  ///< corners around it, counter-clockwise; empty: it is not all in front
};

SeenBox seen_box(const Transform& world_from_volume, glm::dvec3 low_m, glm::dvec3 high_m,
                 const Eye& eye) {
  SeenBox box;
  bool in_front = true;
  for (int c = 0; c < 8; ++c) {
    const glm::dvec3 end(c & 1, c >> 1 & 1, c >> 2);
    const glm::dvec3 at = world_from_volume.world_from_volume(glm::mix(low_m, high_m, end));
    const glm::dvec3 from_eye = glm::conjugate(eye.orientation) * (at - eye.position_m);
    box.corners_m[size_t(c)] = at;
    in_front = in_front && from_eye.z < 0.0;
    box.seen[size_t(c)] = glm::dvec2(from_eye) / std::max(-from_eye.z, 1e-9);
  }
  if (!in_front) return box;
  // Jarvis's march, from the leftmost corner: each next one has all others at its left.
  const auto left_of = [&](int from, int to, int c) {
    const glm::dvec2 a = box.seen[size_t(to)] - box.seen[size_t(from)];
    const glm::dvec2 b = box.seen[size_t(c)] - box.seen[size_t(from)];
    return a.x * b.y - a.y * b.x;
  };
  int first = 0;
  for (int c = 1; c < 8; ++c)
    if (box.seen[size_t(c)].x < box.seen[size_t(first)].x) first = c;
  int at = first;
  do {
    box.outline.push_back(at);
    int next = at == 0 ? 1 : 0;
    for (int c = 0; c < 8; ++c)
      if (c != at && left_of(at, next, c) < 0.0) next = c;
    at = next;
  } while (at != first && box.outline.size() < 8);
  return box;
}

/// How far a place is outside the outline, in tangents; below 0: inside.
double outside(const SeenBox& box, glm::dvec2 at) {
  double most = -1e9;
  for (size_t k = 0; k < box.outline.size(); ++k) {
    const glm::dvec2 a = box.seen[size_t(box.outline[k])];
    const glm::dvec2 b = box.seen[size_t(box.outline[(k + 1) % box.outline.size()])];
    const glm::dvec2 out = glm::normalize(glm::dvec2(b.y - a.y, a.x - b.x));
    most = std::max(most, glm::dot(at - a, out));
  }
  return most;
}

bool on_face(int corner, int axis, int side) {
  return (corner >> axis & 1) == side;
}

}  // namespace

void add_letters(Things& things, const Transform& world_from_volume, glm::dvec3 low_m,
                 glm::dvec3 high_m, const Eye& eye, double height_m, glm::dvec3 colour) {
  constexpr char kLetters[3][2] = {{'R', 'L'}, {'I', 'S'}, {'P', 'A'}};
  constexpr double kApart = 1.1;  // heights from the box to the middle of a letter
  const glm::dvec3 right = eye.orientation * glm::dvec3(1.0, 0.0, 0.0);
  const glm::dvec3 up = eye.orientation * glm::dvec3(0.0, 1.0, 0.0);
  const SeenBox box = seen_box(world_from_volume, low_m, high_m, eye);
  const size_t count = box.outline.size();
  const auto seen = [&](glm::dvec3 at) {
    const glm::dvec3 from_eye = glm::conjugate(eye.orientation) * (at - eye.position_m);
    return glm::dvec3(glm::dvec2(from_eye) / std::max(-from_eye.z, 1e-9), -from_eye.z);
  };

  // Places beside the outline: the middles of its edges, and its corners.
  struct LetterPlace {
    glm::dvec3 at;
    int from, to;  ///< corners at its ends; the same twice: a corner
    bool taken = false;
  };
  std::vector<LetterPlace> places;
  for (size_t k = 0; k < count; ++k) {
    const int before = box.outline[(k + count - 1) % count], here = box.outline[k];
    const int after = box.outline[(k + 1) % count];
    const auto out_of = [&](int from, int to) {
      const glm::dvec2 way = box.seen[size_t(to)] - box.seen[size_t(from)];
      return glm::normalize(glm::dvec2(way.y, -way.x));
    };
    const auto beside = [&](glm::dvec3 at, glm::dvec2 out) {
      return at + kApart * height_m * (out.x * right + out.y * up);
    };
    const glm::dvec3 middle = 0.5 * (box.corners_m[size_t(here)] + box.corners_m[size_t(after)]);
    places.push_back({beside(middle, out_of(here, after)), here, after});
    const glm::dvec2 bisector = glm::normalize(out_of(before, here) + out_of(here, after));
    places.push_back({beside(box.corners_m[size_t(here)], bisector), here, here});
  }

  struct Face {
    int axis, side;
    glm::dvec3 middle_m;
    std::optional<glm::dvec3> place;
  };
  std::vector<Face> faces;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      glm::dvec3 face = 0.5 * (low_m + high_m), out(0.0);
      face[axis] = side ? high_m[axis] : low_m[axis];
      out[axis] = side ? 1.0 : -1.0;
      Face of{axis, side,
              world_from_volume.world_from_volume(face) +
                  world_from_volume.rotation * (kApart * height_m * out),
              std::nullopt};
      // In front of its face, where that is beside the box.
      const glm::dvec3 at = seen(of.middle_m);
      if (count == 0 || outside(box, glm::dvec2(at)) > 0.6 * height_m / at.z)
        of.place = of.middle_m;
      faces.push_back(of);
    }
  // Else at an edge of the face that is part of the outline, or at a corner, so that no letter
  // stands before the data. The one of the fewest edges chooses first.
  const auto nearest = [&](const Face& face, bool corners) {
    LetterPlace* best = nullptr;
    int found = 0;
    double least = 0.0;
    for (LetterPlace& place : places) {
      if (place.taken || (place.from == place.to) != corners ||
          !on_face(place.from, face.axis, face.side) || !on_face(place.to, face.axis, face.side))
        continue;
      const double apart =
          glm::distance(glm::dvec2(seen(place.at)), glm::dvec2(seen(face.middle_m)));
      if (found++ == 0 || apart < least) best = &place, least = apart;
    }
    return std::pair(best, found);
  };
  for (size_t k = 0; k < faces.size(); ++k) {
    Face* next = nullptr;
    int fewest = 0;
    for (Face& face : faces) {
      if (face.place) continue;
      const int found = nearest(face, false).second;
      if (!next || found < fewest) next = &face, fewest = found;
    }
    if (!next) break;
    LetterPlace* place = nearest(*next, false).first;
    if (!place) place = nearest(*next, true).first;
    if (place) place->taken = true;
    next->place = place ? place->at : next->middle_m;
  }
  // A letter that the border of the picture would cut comes in, by its own height at most.
  for (Face& face : faces) {
    const glm::dvec3 at = seen(*face.place);
    if (at.z <= 0.0) continue;
    const double half = 0.6 * height_m / at.z;
    const auto inwards = [&](double tangent, double low, double high) {
      const double within = std::clamp(tangent, low + half, std::max(high - half, low + half));
      return std::clamp((within - tangent) * at.z, -height_m, height_m);
    };
    *face.place += inwards(at.x, eye.tan_left, eye.tan_right) * right +
                   inwards(at.y, eye.tan_down, eye.tan_up) * up;
  }
  for (const Face& face : faces)
    for (const Stroke& stroke : strokes_of(kLetters[face.axis][face.side]))
      for (size_t k = 1; k < stroke.size(); ++k) {
        const auto at = [&](glm::dvec2 p) {
          return *face.place + height_m * (p.x * right + p.y * up);
        };
        add_rod(things, at(stroke[k - 1]), at(stroke[k]), 0.07 * height_m, colour);
      }
}

namespace {

/// The place of a length between the least and the most, on a logarithmic scale, 0 to 1.
double share_of(double length, double least, double most) {
  if (!(length > 0.0) || !(least < most)) return 0.0;
  return std::clamp(std::log(length / least) / std::log(most / least), 0.0, 1.0);
}

}  // namespace

glm::dvec3 tube_colour(double length, double least, double most) {
  return heat(share_of(length, least, most));
}

glm::dvec3 released_tube_colour(double length, double least, double most) {
  constexpr glm::dvec3 kBlue(0.16, 0.38, 1.0), kGreen(0.10, 0.85, 0.40), kYellow(1.0, 0.92, 0.10);
  const double share = share_of(length, least, most);
  return share < 0.5 ? glm::mix(kBlue, kGreen, 2.0 * share)
                     : glm::mix(kGreen, kYellow, 2.0 * share - 1.0);
}

TubeColours tube_colours(std::string name, std::string unit, double least, double most,
                         glm::dvec3 (*colour)(double, double, double)) {
  constexpr int kSteps = 16;
  TubeColours of{std::move(name), std::move(unit), least, most, {}};
  for (int k = 0; k <= kSteps; ++k)
    of.colours.push_back(colour(least * std::pow(most / least, double(k) / kSteps), least, most));
  return of;
}

glm::dvec2 add_stream_tubes(Things& things, const Transform& world_from_volume,
                            const FrameData& data, const TubeOptions& options) {
  const auto vector = [&](glm::dvec3 x) {
    return options.gradient ? data.scalar_gradient(x) : data.vector(x);
  };
  LineOptions line;
  line.low_m = data.low_m();
  line.high_m = data.high_m();
  line.step_m = data.detail_m();
  line.most_steps = options.most_segments;
  line.least_length = options.least_length;
  const glm::dvec3 extent = data.high_m() - data.low_m();
  struct LineSegment {
    glm::dvec3 from, to;
    double length;
  };
  std::vector<LineSegment> segments;
  const int n = options.seeds_per_axis;
  for (int seed = 0; seed < n * n * n; ++seed) {
    const glm::dvec3 cell(seed % n, seed / n % n, seed / n / n);
    const glm::dvec3 start = data.low_m() + extent * (cell + 0.5) / double(n);
    for (const double direction : {1.0, -1.0}) {
      const std::vector<glm::dvec3> places = field_line(vector, start, direction, line).places_m;
      for (size_t k = 1; k < places.size(); ++k)
        segments.push_back(
            {places[k - 1], places[k], glm::length(vector(0.5 * (places[k - 1] + places[k])))});
    }
  }
  double least = 1e300, most = 0.0;
  for (const LineSegment& s : segments)
    if (s.length > 0.0) least = std::min(least, s.length), most = std::max(most, s.length);
  for (const LineSegment& s : segments)
    add_rod(things, world_from_volume.world_from_volume(s.from),
            world_from_volume.world_from_volume(s.to), options.radius_m,
            tube_colour(s.length, least, most));
  return {least, most};
}

}  // namespace palpate
