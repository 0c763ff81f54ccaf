#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "module/view/eye.h"
#include "module/view/picture.h"

namespace palpate {

/// How the rays of one of several pictures of a scene differ from those of the others.
struct RayPlace {
  glm::dvec2 pixels{0.0};  ///< where each goes through its pixel, from the middle
  double steps = 0.0;      ///< how far its samples are moved along it, in steps between samples
};
/// Of picture n, from 0 on. Picture 0 is drawn as a picture of its own is; the rays of any number
/// of pictures from there on are spread evenly over a pixel.
RayPlace ray_place(int n);

/// The eye with its rays moved by so many pixels, to the right and down.
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
