#include "module/view/things.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

void add_rod(Things& things, glm::dvec3 from, glm::dvec3 to, double radius_m, glm::dvec3 colour) {
  things.push_back({from, to, radius_m, radius_m, colour});
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

void add_box(Things& things, const Transform& world_from_volume, const DataBox& box,
             double radius_m, glm::dvec3 colour) {
  const auto corner = [&](int c) { return world_from_volume.world_from_volume(box.corner(c)); };
  for (int c = 0; c < 8; ++c)
    for (int axis = 0; axis < 3; ++axis)
      if (!(c >> axis & 1)) add_rod(things, corner(c), corner(c | 1 << axis), radius_m, colour);
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

}  // namespace palpate
