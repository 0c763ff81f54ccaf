#pragma once

#include "module/haptics/proxy/placed.h"

namespace palpate {

/// What follows from the primitives at one or two places for the way between them. World; m, N,
/// N/m. All are real-time safe and pure.

/// By how much plane i is stronger than the spring that presses on it, N.
double margin_n(const Placed& placed, int i, double stiffness_n_per_m) noexcept;

/// Two sets whose primitives answer each other one by one.
bool alike(const Placed& a, const Placed& b) noexcept;

/// Where `a` is, with the mean direction and strength of both. They must be alike.
void mean(const Placed& a, const Placed& b, Placed& out) noexcept;

/// Whether primitive i is a plane that holds the proxy at both places: it slides along it.
bool slides(const Placed& here, const Placed& there, int i, double stiffness_n_per_m) noexcept;

/// Whether the surface that the proxy slides along turns so much between the two places that the
/// way has to be sampled more finely.
bool bends(const Placed& here, const Placed& there, double stiffness_n_per_m) noexcept;

/// How far a slide has to go where the surface bends. A plane has no curvature: it takes the proxy
/// to the point of the plane that is nearest to the hand (`straight`). With the hand at a depth d
/// behind a surface of curvature c that falls short of the balance by the share c d in every frame.
/// Newton's step along the surface is longer by 1 / (1 - c d); the curvature follows from how much
/// the normal turned. Where other primitives act as well, and for moves shorter than `short_m`:
/// `midway`, the balance of the mean, as it is.
glm::dvec3 bent(const Placed& here, const Placed& there, glm::dvec3 straight, glm::dvec3 midway,
                double short_m, double stiffness_n_per_m) noexcept;

/// The share of `way` at which the forces of the data, taken as linear from here to there (`share`
/// of the way), and the spring balance. At the share a forces and spring leave k ((1 - a) way + a /
/// share change); they balance where that has no part along the way. The way's end was found with
/// the force at its start. Where a force that grows along the way grows faster than the spring's,
/// the proxy would jump between both ends for ever. 1 where forces do not push back.
double where_forces_balance(const Placed& here, const Placed& there, glm::dvec3 way,
                            double share) noexcept;

}  // namespace palpate
