#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "integration/openigtlink/message.h"

namespace palpate::openigtlink {

/// An image that a sender gives in parts: by slices, blocks or lines, in any order, over and over.
/// Memory grows with the samples that have come, not with the size that a part claims: parts wait
/// side by side until there are enough of them to fill the image. One thread.
class PartedImage {
 public:
  enum class Came {
    kPart,   ///< more has to come
    kAgain,  ///< so does it, and parts came again before others came at all; said once
    kWhole   ///< every sample has come since the image was whole last
  };

  /// The image that a part is of; put() the part itself then.
  explicit PartedImage(const Image& part);
  /// Whether a part is of this image: of the same grid, in the same order of samples.
  bool takes(const Image& part) const;
  /// Of a part that takes() said yes to. Samples that come again replace those that came before.
  Came put(const Image& part);

  bool was_whole() const { return was_whole_; }
  /// Needs was_whole(): a sample of the part has come already since the image was whole last, so
  /// that the sender has begun the next image.
  bool begins_next(const Image& part) const;
  /// After that, before put(): what came counts for the image before.
  void end_round();
  /// Needs was_whole(): the newest of every sample.
  const Image& image() const { return image_; }

 private:
  struct Box {
    glm::ivec3 first, size;
    size_t count() const { return size_t(size.x) * size_t(size.y) * size_t(size.z); }
  };
  void write(const Box& box, const float* values);

  Image image_;  ///< its values: none until as many samples came as it has
  std::vector<Box> boxes_;
  std::vector<float> waiting_;  ///< the samples of these boxes
  std::vector<bool> came_;      ///< since the image was whole last
  size_t missing_ = 0;
  bool was_whole_ = false;
};

}  // namespace palpate::openigtlink
