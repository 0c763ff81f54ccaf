#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "module/scene/data_box.h"
#include "module/scene/transform.h"

namespace palpate {

/// An opaque thing: all spheres between two, their centres and radii blended. A sphere, a rod with
/// round ends, an arrow's head: everything that is drawn beside volumes is made of these. World, m.
struct RoundCone {
  glm::dvec3 from{0.0}, to{0.0};
  double from_radius_m = 1e-3, to_radius_m = 1e-3;
  glm::dvec3 colour{0.9};  ///< sRGB
  bool operator==(const RoundCone&) const = default;
};

/// All functions below append to `things`; positions are world, m.
using Things = std::vector<RoundCone>;

void add_sphere(Things& things, glm::dvec3 centre, double radius_m, glm::dvec3 colour);

/// The probe as a pen: its tip (of radius_m) at `tip`, its shaft going away along `away` (unit).
void add_pen(Things& things, glm::dvec3 tip, glm::dvec3 away, double radius_m, double length_m,
             glm::dvec3 colour);

/// A force: an arrow from `from` by force_n * m_per_n. Nothing where it would be shorter than its
/// own thickness.
void add_arrow(Things& things, glm::dvec3 from, glm::dvec3 force_n, double m_per_n, double radius_m,
               glm::dvec3 colour);

/// The edges of a box, given in a volume's space.
void add_box(Things& things, const Transform& world_from_volume, const DataBox& box,
             double radius_m, glm::dvec3 colour);

/// The colour of a stream tube where the vectors have this length: from blue (`least`) over white
/// to red (`most`), logarithmically.
glm::dvec3 tube_colour(double length, double least, double most);

/// Of one that a hand has laid, which lies on organs: from blue over green to yellow, none of which
/// is the colour of flesh or bone.
glm::dvec3 released_tube_colour(double length, double least, double most);

/// What the colours of tubes mean, for those who name them beside a picture.
struct TubeColours {
  std::string name;  ///< of what they show
  std::string unit;
  double least = 0.0, most = 0.0;
  std::vector<glm::dvec3> colours;  ///< sRGB, at even steps of the logarithm from least to most
  bool operator==(const TubeColours&) const = default;
};
/// The colours of `colour` (one of the two functions above) over this range.
TubeColours tube_colours(std::string name, std::string unit, double least, double most,
                         glm::dvec3 (*colour)(double, double, double));

}  // namespace palpate
