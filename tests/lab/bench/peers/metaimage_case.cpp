#include "tests/lab/bench/peers/metaimage_case.h"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <utility>
#include <vector>

#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkMetaImageIO.h>

namespace palpate::peers {
namespace {

template <class Pixel>
typename itk::Image<Pixel, 3>::Pointer read_itk(const std::string& path) {
  auto reader = itk::ImageFileReader<itk::Image<Pixel, 3>>::New();
  reader->SetImageIO(itk::MetaImageIO::New());
  reader->SetFileName(path);
  reader->Update();
  return reader->GetOutput();
}

Grid grid_of(const itk::ImageBase<3>& image) {
  Grid grid;
  const auto size = image.GetLargestPossibleRegion().GetSize();
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<unsigned>(axis);
    grid.size[axis] = static_cast<int>(size[a]);
    grid.spacing_mm[axis] = image.GetSpacing()[a];
    grid.origin_mm[axis] = image.GetOrigin()[a];
    for (int row = 0; row < 3; ++row) grid.direction[axis][row] = image.GetDirection()[row][a];
  }
  return grid;
}

Volume read_volume(const std::string& path) {
  const auto image = read_itk<float>(path);
  Volume volume{grid_of(*image), {}};
  volume.values.assign(image->GetBufferPointer(), image->GetBufferPointer() + volume.grid.count());
  return volume;
}

std::pair<double, double> mean_and_p95(std::vector<double> values) {
  if (values.empty()) return {0.0, 0.0};
  const auto p95 = values.begin() + long(0.95 * double(values.size() - 1));
  std::nth_element(values.begin(), p95, values.end());
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return {sum / double(values.size()), *p95};
}

}  // namespace

Result<KnownPair> read_known_pair(const std::string& prefix) {
  try {
    KnownPair pair;
    pair.fixed = read_volume(prefix + "_fixed.mha");
    pair.moving = read_volume(prefix + "_moving.mha");
    const auto body = read_itk<uint8_t>(prefix + "_body.mha");
    pair.body.grid = grid_of(*body);
    pair.body.values.assign(body->GetBufferPointer(),
                            body->GetBufferPointer() + pair.body.grid.count());
    const auto truth = read_itk<itk::Vector<float, 3>>(prefix + "_truth.mha");
    pair.truth.grid = grid_of(*truth);
    for (size_t n = 0; n < pair.truth.grid.count(); ++n) {
      const auto& u = truth->GetBufferPointer()[n];
      pair.truth.u_mm.emplace_back(u[0], u[1], u[2]);
    }
    for (const Grid& other : {pair.moving.grid, pair.truth.grid, pair.body.grid}) {
      if (!same_geometry(pair.fixed.grid, other)) {
        return Error{ErrorKind::kBadInput,
                     "The files " + prefix + "_*.mha do not share one grid: use a matching set."};
      }
    }
    return pair;
  } catch (const itk::ExceptionObject& failure) {
    return Error{ErrorKind::kBadInput,
                 "The files " + prefix + "_*.mha could not be read: " + failure.GetDescription()};
  }
}

EndpointError endpoint_error(const Field& field, const KnownPair& pair) {
  assert(same_geometry(field.grid, pair.truth.grid));
  const glm::dmat3 index_axes = glm::transpose(field.grid.direction);
  std::vector<double> own_voxels;
  std::vector<double> finest_voxels;
  for (size_t n = 0; n < field.u_mm.size(); ++n) {
    if (!pair.body.values[n]) continue;
    const glm::dvec3 miss_mm = index_axes * glm::dvec3(field.u_mm[n] - pair.truth.u_mm[n]);
    own_voxels.push_back(glm::length(miss_mm / field.grid.spacing_mm));
    finest_voxels.push_back(glm::length(miss_mm) / field.grid.finest_mm());
  }
  const auto [mean_own, p95_own] = mean_and_p95(std::move(own_voxels));
  const auto [mean_finest, p95_finest] = mean_and_p95(std::move(finest_voxels));
  return {mean_own, p95_own, mean_finest, p95_finest};
}

}  // namespace palpate::peers
