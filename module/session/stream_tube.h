#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "module/haptics/scene/scene.h"
#include "module/scene/moving_volume.h"

namespace palpate {

/// The field that a stream tube follows.
enum class TubeField : uint8_t {
  kVectors,   ///< vector data
  kGradient,  ///< of scalar data
  kCurl,      ///< of vector data
  kVelocity,  ///< of the moving material
};

/// Its name, and its unit: "data", "data per m" or "m/s". Static storage.
const char* word(TubeField field) noexcept;
const char* unit(TubeField field) noexcept;

/// The field that a tube in this volume follows, the first of: the vectors that a mode is guided or
/// pushed along (follow, front, vector-force), as in the paper, where tubes show the field that is
/// felt. Else the vectors of vector data; the gradient, if the scene wants stream tubes of scalar
/// data; the velocity of moving data. Empty for scalar data that stand still.
std::optional<TubeField> tube_field(const Scene& scene, size_t volume);

/// A stream tube as a line of material: the field line through a place at one instant, which from
/// then on moves with the data. Immutable; any thread.
class StreamTube {
 public:
  /// The line of `field` through `seed_m` (volume space, m, where the hand is at `pointer`), to
  /// both sides, in steps of at most half a detail_m() of the data. The field is that of equations
  /// (23) to (25) in the data frame, as modes read it; the motion then moves the line as it moves
  /// the primitives of modes. The error is that of field_line() plus that of interpolating the
  /// data. Errors, with a sentence for the user: kBadInput: the seed lies outside the data, the
  /// motion can not be inverted there, or the field has no direction there. Takes milliseconds.
  static Result<StreamTube> release(std::shared_ptr<const MovingVolume> data, bool blend_values,
                                    TubeField field, FramePointer pointer, glm::dvec3 seed_m);

  /// The same material in another form of the volume that agrees with this one at `pointer`, for
  /// example data that got their motion. The line ends where the other's motion can not be
  /// inverted; empty if that is at the seed.
  std::optional<StreamTube> moved_to(std::shared_ptr<const MovingVolume> data,
                                     FramePointer pointer) const;

  /// Its present places, volume space, m. Exact with respect to the data's motion: fields lead from
  /// frame to frame along straight lines, one motion for all times gives every time.
  std::vector<glm::dvec3> places(FramePointer pointer) const;

  const std::shared_ptr<const MovingVolume>& data() const { return data_; }
  TubeField field() const { return field_; }
  /// The time at which it was released and the places at that time: the field line itself.
  FramePointer released() const { return released_; }
  const std::vector<glm::dvec3>& released_m() const { return released_m_; }
  /// Length of the vector at each place when it was released; see unit().
  const std::vector<double>& lengths() const { return lengths_; }
  size_t seed() const { return seed_; }  ///< index of the place where the hand was
  bool closed() const { return closed_; }

 private:
  StreamTube() = default;
  bool carry(FramePointer pointer, const std::vector<glm::dvec3>& places_m);
  void keep(size_t begin, size_t end);

  std::shared_ptr<const MovingVolume> data_;
  TubeField field_ = TubeField::kVectors;
  FramePointer released_;
  std::vector<glm::dvec3> released_m_;
  std::vector<double> lengths_;
  size_t seed_ = 0;
  bool closed_ = false;
  /// Per frame: the places of the material in it. A single entry, in the reference frame, if the
  /// data stand still or have one motion for all times.
  std::vector<std::vector<glm::dvec3>> material_m_;
};

}  // namespace palpate
