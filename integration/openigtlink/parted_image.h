#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <unordered_map>
#include <vector>

#include "integration/openigtlink/message.h"

namespace palpate::openigtlink {

/// An image that a sender gives in parts: by slices, blocks or lines, in any order, over and over.
/// Memory grows with the places whose samples have come, not with the size that a part claims nor
/// with how often the same ones come: until all have come, samples lie in short runs, each made
/// when the first of its samples comes. One thread.
class PartedImage {
 public:
  enum class Came {
    kPart,   ///< more has to come
    kAgain,  ///< so does it, and samples came again before others came at all; said once
    kWhole   ///< every sample has come since the image was whole last
  };

  /// The image that a part is of; put() the part itself then.
  explicit PartedImage(const ImageMessage& part);
  /// Whether a part is of this image: of the same grid, in the same order of samples.
  bool takes(const ImageMessage& part) const;
  /// Of a part that takes() said yes to. Samples that come again replace those that came before.
  Came put(const ImageMessage& part);

  bool was_whole() const { return was_whole_; }
  /// Needs was_whole(): a sample of the part has come already since the image was whole last, so
  /// that the sender has begun the next image.
  bool begins_next(const ImageMessage& part) const;
  /// After that, before put(): what came counts for the image before.
  void end_round();
  /// Needs was_whole(): the newest of every sample.
  const ImageMessage& image() const { return image_; }

 private:
  static constexpr size_t kRun = 64;  ///< the bits of Run::came
  /// Samples that follow each other in the image; bit n of `came`: values[n] has come.
  struct Run {
    std::array<float, kRun> values{};
    uint64_t came = 0;
  };
  void put_in_runs(size_t at, const float* values, size_t count);
  void put_in_image(size_t at, const float* values, size_t count);
  void join_runs();

  ImageMessage image_;                    ///< its values: none until all of them came
  std::unordered_map<size_t, Run> runs_;  ///< until then: the run of sample n is n / kRun
  std::vector<bool> came_;                ///< after that: since the image was whole last
  size_t missing_ = 0;
  bool was_whole_ = false, again_ = false, said_again_ = false;
};

}  // namespace palpate::openigtlink
