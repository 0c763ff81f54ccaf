#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace palpate {

/// What a haptic mode asks for: the paper's equations (7) to (10). Positions in m, directions of
/// unit length, strengths in N, all in one space.
struct Primitive {
  enum class Kind : uint8_t {
    /// (7) s q while (x - position).q < 0: holds the proxy on the side q points to, one-sided
    kPlane,
    kLine,   ///< (8) s towards the line through position along q
    kPoint,  ///< (9) s towards position
    kForce,  ///< (10) s q, always; position is not used
  };
  Kind kind = Kind::kPlane;
  glm::dvec3 position{0.0};
  glm::dvec3 direction{0.0, 0.0, 1.0};  ///< q; not used by points
  double strength_n = 0.0;              ///< s >= 0
  /// Planes only: a line along q is added whose strength is friction times the plane's own normal
  /// force, at most friction times s: Coulomb friction, equation (12). 0: none.
  double friction = 0.0;
};

/// A fixed store for the primitives of one haptic frame, from any number of modes. Real-time safe.
class PrimitiveSet {
 public:
  static constexpr int kCapacity = 32;
  void clear() { count_ = 0; }
  /// False, and nothing added, if it is full. A strength <= 0 without friction adds nothing and is
  /// no error.
  bool add(const Primitive& primitive) {
    if (!(primitive.strength_n > 0.0)) return true;
    if (count_ == kCapacity) return false;
    items_[count_++] = primitive;
    return true;
  }
  int count() const { return count_; }
  bool empty() const { return count_ == 0; }
  const Primitive* begin() const { return items_.data(); }
  const Primitive* end() const { return items_.data() + count_; }
  Primitive* begin() { return items_.data(); }
  Primitive* end() { return items_.data() + count_; }
  const Primitive& operator[](int i) const { return items_[i]; }

 private:
  std::array<Primitive, kCapacity> items_;
  int count_ = 0;
};

}  // namespace palpate
