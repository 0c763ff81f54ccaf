#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "module/view/eye.h"
#include "module/view/picture.h"

namespace palpate {

/// Of one of several pictures of the same scene: where in its pixel a ray goes, in pixels from the
/// middle, and by how much its samples are moved, in their steps.
struct RayPlace {
  glm::dvec2 pixels{0.0};
  double steps = 0.0;
};
/// Of picture n, from 0 on: picture 0 is as any other picture, and any number of pictures spread
/// their rays evenly over a pixel.
RayPlace ray_place(int n);

/// The eye whose rays go through other places of the pixels.
Eye with_rays_at(const Eye& eye, PictureSize size, glm::dvec2 pixels);

/// The mean of pictures of one scene, each with its own ray_place(): smoother edges and less noise
/// than any of them has. Values; one thread.
class PictureMean {
 public:
  /// Of the size of the others since the last clear().
  void add(const Picture& picture);
  void clear() { count_ = 0; }
  int count() const { return count_; }
  /// As linear light; depths are those of the first. After the first add().
  Picture mean() const;

 private:
  int count_ = 0;
  Picture first_;
  std::vector<glm::vec4> sums_;  ///< light, and coverage from 0 to 255
};

}  // namespace palpate
