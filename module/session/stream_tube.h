#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "module/haptics/scene.h"
#include "module/scene/moving_volume.h"

namespace palpate {

/// What a stream tube runs along.
enum class TubeField : uint8_t {
  kVectors,   ///< vector data
  kGradient,  ///< of scalar data
  kCurl,      ///< of vector data
  kVelocity,  ///< of the moving material
};

/// A word, and the unit of lengths: "data", "data per m" or "m/s". Static storage.
const char* word(TubeField field) noexcept;
const char* unit(TubeField field) noexcept;

/// The field that a tube in this volume of the scene follows, in this order: what a mode that is
/// guided or pushed along vectors (follow, front, vector-force) reads, as in the paper, where tubes
/// show the field that is felt; the vectors of vector data; the gradient, where the scene wants
/// stream tubes of scalar data drawn; the velocity of data that move. None: still scalar data.
std::optional<TubeField> tube_field(const Scene& scene, size_t volume);

/// A stream tube as a line of material: the field line through a place at one instant, which moves
/// with the data from then on. Immutable; any thread.
class StreamTube {
 public:
  /// The line of `field` through `seed_m` (volume space, m, where the hand is at `pointer`), in
  /// steps of half a detail_m() of the data, or shorter ones, to either side. The field is that of
  /// equations (23) to (25) in the data frame, as modes read it; the line goes to where the motion
  /// brings it, as their primitives do. The error is that of field_line(), and what interpolation
  /// of the data adds. kBadInput, in a sentence for a person: the seed lies outside the data, the
  /// motion can not be inverted there, or there is no direction to follow. Takes milliseconds.
  static Result<StreamTube> release(std::shared_ptr<const MovingVolume> data, bool blend_values,
                                    TubeField field, FramePointer pointer, glm::dvec3 seed_m);

  /// The same material in another form of the volume, which agrees with this one at `pointer`: data
  /// that got their motion, say. Ends where the other's motion can not be inverted; none if that is
  /// at the seed.
  std::optional<StreamTube> moved_to(std::shared_ptr<const MovingVolume> data,
                                     FramePointer pointer) const;

  /// Where its places are, volume space, m. Exact as the data's motion is: fields lead from frame
  /// to frame along straight ways, one motion for all times gives every time.
  std::vector<glm::dvec3> places(FramePointer pointer) const;

  const std::shared_ptr<const MovingVolume>& data() const { return data_; }
  TubeField field() const { return field_; }
  /// When it was released, and where it was then: the field line itself.
  FramePointer released() const { return released_; }
  const std::vector<glm::dvec3>& released_m() const { return released_m_; }
  /// Of the vector at each place when it was released; see unit().
  const std::vector<double>& lengths() const { return lengths_; }
  size_t seed() const { return seed_; }  ///< which of the places the hand was at
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
  /// By frame: where the material is in it. One alone where the data stand still, or one motion
  /// tells all times: then in its reference frame.
  std::vector<std::vector<glm::dvec3>> material_m_;
};

}  // namespace palpate
