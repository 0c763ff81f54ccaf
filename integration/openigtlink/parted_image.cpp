#include "integration/openigtlink/parted_image.h"

#include <algorithm>

namespace palpate::openigtlink {

PartedImage::PartedImage(const ImageMessage& part) : missing_(part.grid.count()) {
  image_.grid = part.grid;
  image_.j_reversed = part.j_reversed;
  image_.size = part.grid.size;
}

bool PartedImage::takes(const ImageMessage& part) const {
  return same_geometry(image_.grid, part.grid) && image_.j_reversed == part.j_reversed;
}

PartedImage::Came PartedImage::put(const ImageMessage& part) {
  const float* values = part.values.data();
  for (int k = 0; k < part.size.z; ++k)
    for (int j = 0; j < part.size.y; ++j) {
      const size_t at = image_.grid.offset(part.first.x, part.first.y + j, part.first.z + k);
      if (was_whole_)
        put_in_image(at, values, size_t(part.size.x));
      else
        put_in_runs(at, values, size_t(part.size.x));
      values += part.size.x;
    }
  if (missing_ == 0) {
    if (!was_whole_) join_runs();
    was_whole_ = true;
    end_round();
    return Came::kWhole;
  }
  if (was_whole_ || !again_ || said_again_) return Came::kPart;
  said_again_ = true;
  return Came::kAgain;
}

bool PartedImage::begins_next(const ImageMessage& part) const {
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

void PartedImage::put_in_runs(size_t at, const float* values, size_t count) {
  for (const size_t end = at + count; at < end;) {
    Run& run = runs_[at / kRun];
    for (size_t n = at % kRun; n < kRun && at < end; ++n, ++at) {
      const uint64_t bit = uint64_t(1) << n;
      run.values[n] = *values++;
      if (run.came & bit)
        again_ = true;
      else
        --missing_;
      run.came |= bit;
    }
  }
}

void PartedImage::put_in_image(size_t at, const float* values, size_t count) {
  std::copy_n(values, count, image_.values.begin() + ptrdiff_t(at));
  for (size_t n = at; n < at + count; ++n)
    if (!came_[n]) {
      came_[n] = true;
      --missing_;
    }
}

void PartedImage::join_runs() {
  image_.values.resize(image_.grid.count());
  for (const auto& [index, run] : runs_) {
    const size_t at = index * kRun;
    std::copy_n(run.values.begin(), std::min(kRun, image_.values.size() - at),
                image_.values.begin() + ptrdiff_t(at));
  }
  runs_ = {};
}

}  // namespace palpate::openigtlink
