#pragma once

#include "module/view/eye.h"
#include "module/view/things.h"

namespace palpate {

/// The letters of the patient's sides beside the faces of a box in a volume's space (x = L, y = S,
/// z = -P): L at +x, R at -x, S at +y, I at -y, A at +z, P at -z. They face the eye and stand
/// upright for it. Where the middle of a face is seen before or behind the box, its letter stands
/// at an edge or corner of the face that is part of the box's outline. height_m: of a letter.
void add_letters(Things& things, const Transform& world_from_volume, glm::dvec3 low_m,
                 glm::dvec3 high_m, const Eye& eye, double height_m, glm::dvec3 colour);

}  // namespace palpate
