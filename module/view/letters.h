#pragma once

#include <span>

#include "module/view/eye.h"
#include "module/view/things.h"

namespace palpate {

/// The patient's sides beside the faces of a box in a volume's space (x = L, y = S, z = A), by
/// their letters (side_of): one of a box along these axes, up to three of one that lies obliquely.
/// They face the eye and stand upright for it. Where the middle of a face is seen before or behind
/// the box, its letters stand at an edge or corner of the face that is part of the box's outline. A
/// face without one, at the back of a box that is seen straight, has no letters. All this is for
/// the first eye; letters that the border of its picture would cut, or of another eye's, come in by
/// up to their height. eyes: one or more. height_m: of a letter.
void add_letters(Things& things, const Transform& world_from_volume, const DataBox& box,
                 std::span<const Eye> eyes, double height_m, glm::dvec3 colour);

}  // namespace palpate
