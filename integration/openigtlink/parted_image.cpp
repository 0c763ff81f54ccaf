#include "integration/openigtlink/parted_image.h"

#include <algorithm>

namespace palpate::openigtlink {

PartedImage::PartedImage(const Image& part) {
  image_.grid = part.grid;
  image_.j_reversed = part.j_reversed;
  image_.size = part.grid.size;
}

bool PartedImage::takes(const Image& part) const {
  return same_geometry(image_.grid, part.grid) && image_.j_reversed == part.j_reversed;
}

PartedImage::Came PartedImage::put(const Image& part) {
  const Box box{part.first, part.size};
  if (image_.values.empty()) {
    boxes_.push_back(box);
    waiting_.insert(waiting_.end(), part.values.begin(), part.values.end());
    if (waiting_.size() < image_.grid.count()) return Came::kPart;
    image_.values.resize(image_.grid.count());
    end_round();
    const float* values = waiting_.data();
    for (const Box& one : boxes_) {
      write(one, values);
      values += one.count();
    }
    boxes_ = {};
    waiting_ = {};
    if (missing_ > 0) return Came::kAgain;
  } else {
    write(box, part.values.data());
  }
  if (missing_ > 0) return Came::kPart;
  was_whole_ = true;
  end_round();
  return Came::kWhole;
}

bool PartedImage::begins_next(const Image& part) const {
  const glm::ivec3 first = part.first, end = part.first + part.size;
  for (int k = first.z; k < end.z; ++k)
    for (int j = first.y; j < end.y; ++j)
      for (int i = first.x; i < end.x; ++i)
        if (came_[image_.grid.offset(i, j, k)]) return true;
  return false;
}

void PartedImage::end_round() {
  missing_ = image_.grid.count();
  came_.assign(missing_, false);
}

void PartedImage::write(const Box& box, const float* values) {
  for (int k = 0; k < box.size.z; ++k)
    for (int j = 0; j < box.size.y; ++j) {
      const size_t at = image_.grid.offset(box.first.x, box.first.y + j, box.first.z + k);
      std::copy_n(values, box.size.x, image_.values.begin() + ptrdiff_t(at));
      values += box.size.x;
      for (size_t n = at; n < at + size_t(box.size.x); ++n)
        if (!came_[n]) {
          came_[n] = true;
          --missing_;
        }
    }
}

}  // namespace palpate::openigtlink
