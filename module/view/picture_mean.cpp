#include "module/view/picture_mean.h"

#include <cassert>
#include <cmath>

namespace palpate {
namespace {

/// The additive sequence of three dimensions with the least gaps (Roberts 2018): its constant is
/// the root of x^4 = x + 1.
double spread(int n, int dimension) {
  constexpr double kRoot = 1.2207440846057596;
  const double x = 0.5 + n * std::pow(kRoot, -double(dimension));
  return x - std::floor(x);
}

}  // namespace

RayPlace ray_place(int n) {
  const double steps = spread(n, 3) - 0.5;
  return {{spread(n, 1) - 0.5, spread(n, 2) - 0.5}, steps - std::floor(steps)};
}

Eye with_rays_at(const Eye& eye, PictureSize size, glm::dvec2 pixels) {
  Eye moved = eye;
  const double right = pixels.x * (eye.tan_right - eye.tan_left) / size.width;
  const double down = pixels.y * (eye.tan_up - eye.tan_down) / size.height;
  moved.tan_left += right;
  moved.tan_right += right;
  moved.tan_up -= down;
  moved.tan_down -= down;
  return moved;
}

void PictureMean::add(const Picture& picture) {
  if (count_ == 0) {
    first_ = picture;
    sums_.assign(picture.colours.size(), glm::vec4(0.0F));
  }
  assert(picture.colours.size() == sums_.size());
  for (size_t p = 0; p < sums_.size(); ++p)
    sums_[p] += glm::vec4(light_of(picture.colours[p]), float(picture.colours[p] >> 24));
  ++count_;
}

Picture PictureMean::mean() const {
  Picture mean = first_;
  const float share = 1.0F / float(count_);
  for (size_t p = 0; p < sums_.size(); ++p) {
    const glm::vec4 its = share * sums_[p];
    mean.colours[p] = colour_of(glm::vec3(its), uint32_t(its.w + 0.5F));
  }
  return mean;
}

}  // namespace palpate
