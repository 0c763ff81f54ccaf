#include "integration/app/info/values.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "integration/files/raster/samples.h"

namespace palpate::app {
namespace {

constexpr size_t kChunk = 65536;

}  // namespace

void ValueCounter::add(float value, size_t voxel) {
  ++values_.count;
  // FNV-1a hash, one sample at a time.
  values_.hash = (values_.hash ^ std::bit_cast<uint32_t>(value)) * 0x100000001b3ULL;
  if (!std::isfinite(value)) {
    if (values_.not_finite++ == 0) {
      const size_t nx = size_t(size_.x), ny = size_t(size_.y);
      values_.first_not_finite = {int(voxel % nx), int(voxel / nx % ny), int(voxel / (nx * ny))};
    }
    return;
  }
  low_ = std::min(low_, value);
  high_ = std::max(high_, value);
  sum_ += double(value);
  if (value != std::floor(value)) values_.whole = false;
  if (many_ || value == last_) return;
  last_ = value;
  auto& different = values_.different;
  const auto place = std::lower_bound(different.begin(), different.end(), value);
  if (place != different.end() && *place == value) return;
  different.insert(place, value);
  if (different.size() <= Values::kMostLabels) return;
  many_ = true;
  different.clear();
}

Values ValueCounter::values() const {
  Values values = values_;
  const size_t finite = values.count - values.not_finite;
  if (finite == 0) return values;
  values.low = low_;
  values.high = high_;
  values.mean = sum_ / double(finite);
  return values;
}

Values values_of(const Volume& volume) {
  ValueCounter counter(volume.grid.size);
  for (size_t voxel = 0; voxel < volume.values.size(); ++voxel)
    counter.add(volume.values[voxel], voxel);
  return counter.values();
}

Result<std::vector<Values>> values_of(const files::Raster& raster, const OnShare& on_share) {
  auto stream = files::SampleStream::open(raster);
  if (!stream) return stream.error();
  // Components of a vector are counted together: only whether they are finite is used.
  const bool frames = raster.lane_kind == files::LaneKind::kFrames;
  std::vector<ValueCounter> counters(frames ? raster.lanes : 1, ValueCounter(raster.grid.size));
  std::vector<float> chunk(kChunk);
  for (uint64_t done = 0; done < raster.sample_count();) {
    const size_t count = size_t(std::min<uint64_t>(chunk.size(), raster.sample_count() - done));
    if (const Status got = stream->read(chunk.data(), count); !got) return got.error();
    on_share(double(done) / double(raster.sample_count()));
    // The place of a sample: see Raster.
    for (size_t n = 0; n < count; ++n, ++done) {
      const uint64_t block = done / raster.inner;
      const size_t voxel = size_t(block / raster.lanes * raster.inner + done % raster.inner);
      counters[frames ? size_t(block % raster.lanes) : 0].add(chunk[n], voxel);
    }
  }
  std::vector<Values> all;
  for (const ValueCounter& counter : counters) all.push_back(counter.values());
  return all;
}

}  // namespace palpate::app
