#include "tests/lab/bench/peers/itk_peers.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <utility>

#include <itkCommand.h>
#include <itkDemonsRegistrationFilter.h>
#include <itkDiffeomorphicDemonsRegistrationFilter.h>
#include <itkFastSymmetricForcesDemonsRegistrationFilter.h>
#include <itkImage.h>
#include <itkMultiResolutionPDEDeformableRegistration.h>
#include <itkMultiThreaderBase.h>
#include <itkSymmetricForcesDemonsRegistrationFilter.h>

namespace palpate::peers {
namespace {

using ItkImage = itk::Image<float, 3>;
using ItkField = itk::Image<itk::Vector<float, 3>, 3>;
using Register = itk::PDEDeformableRegistrationFilter<ItkImage, ItkImage, ItkField>;
using Demons = itk::DemonsRegistrationFilter<ItkImage, ItkImage, ItkField>;
using SymmetricForces = itk::SymmetricForcesDemonsRegistrationFilter<ItkImage, ItkImage, ItkField>;
using FastSymmetricForces =
    itk::FastSymmetricForcesDemonsRegistrationFilter<ItkImage, ItkImage, ItkField>;
using Diffeomorphic = itk::DiffeomorphicDemonsRegistrationFilter<ItkImage, ItkImage, ItkField>;
using Pyramid = itk::MultiResolutionPDEDeformableRegistration<ItkImage, ItkImage, ItkField>;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

ItkImage::Pointer to_itk(const Volume& volume) {
  const Grid& grid = volume.grid;
  auto image = ItkImage::New();
  ItkImage::SizeType size;
  ItkImage::SpacingType spacing;
  ItkImage::PointType origin;
  ItkImage::DirectionType direction;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<unsigned>(axis);
    size[a] = static_cast<itk::SizeValueType>(grid.size[axis]);
    spacing[a] = grid.spacing_mm[axis];
    origin[a] = grid.origin_mm[axis];
    // GLM stores columns, ITK rows.
    for (int row = 0; row < 3; ++row) direction[row][a] = grid.direction[axis][row];
  }
  image->SetRegions(size);
  image->SetSpacing(spacing);
  image->SetOrigin(origin);
  image->SetDirection(direction);
  image->Allocate();
  std::copy(volume.values.begin(), volume.values.end(), image->GetBufferPointer());
  return image;
}

Field from_itk(const ItkField& itk_field, const Grid& grid) {
  Field field{grid, std::vector<glm::vec3>(grid.count())};
  const ItkField::PixelType* u = itk_field.GetBufferPointer();
  for (size_t n = 0; n < field.u_mm.size(); ++n) field.u_mm[n] = {u[n][0], u[n][1], u[n][2]};
  return field;
}

// The two ESM filters have the same parameters but no common base class with them.
template <class Esm>
Register::Pointer make_esm(const PeerOptions& options) {
  using Gradient = itk::ESMDemonsRegistrationFunctionEnums::Gradient;
  auto filter = Esm::New();
  filter->SetMaximumUpdateStepLength(options.max_step_voxels);
  switch (options.gradient) {
    case ItkGradient::kSymmetric:
      filter->SetUseGradientType(Gradient::Symmetric);
      break;
    case ItkGradient::kFixed:
      filter->SetUseGradientType(Gradient::Fixed);
      break;
    case ItkGradient::kWarpedMoving:
      filter->SetUseGradientType(Gradient::WarpedMoving);
      break;
    case ItkGradient::kMappedMoving:
      filter->SetUseGradientType(Gradient::MappedMoving);
      break;
  }
  return filter.GetPointer();
}

Register::Pointer make_filter(const PeerOptions& options) {
  switch (options.method) {
    case ItkMethod::kFastSymmetricForces:
      return make_esm<FastSymmetricForces>(options);
    case ItkMethod::kDiffeomorphic:
      return make_esm<Diffeomorphic>(options);
    case ItkMethod::kSymmetricForces:
      return SymmetricForces::New().GetPointer();
    case ItkMethod::kDemons:
      break;
  }
  auto demons = Demons::New();
  demons->SetUseMovingImageGradient(options.gradient == ItkGradient::kMappedMoving);
  return demons.GetPointer();
}

void set_smoothing(Register& filter, double sigma_voxels) {
  filter.SetSmoothDisplacementField(sigma_voxels > 0);
  filter.SetStandardDeviations(std::max(sigma_voxels, 1e-3));
  filter.SetSmoothUpdateField(false);
}

void set_threads(int threads) {
  const auto count = static_cast<itk::ThreadIdType>(std::max(threads, 1));
  itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(count);
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(count);
}

Pyramid::Pointer make_pyramid(const Volume& fixed, const Volume& moving,
                              const PeerOptions& options) {
  auto filter = make_filter(options);
  set_smoothing(*filter, options.sigma_voxels);
  auto pyramid = Pyramid::New();
  pyramid->SetRegistrationFilter(filter);
  pyramid->SetNumberOfLevels(static_cast<unsigned>(options.iterations.size()));
  Pyramid::NumberOfIterationsType iterations(
      static_cast<Pyramid::NumberOfIterationsType::SizeValueType>(options.iterations.size()));
  std::copy(options.iterations.begin(), options.iterations.end(), iterations.begin());
  pyramid->SetNumberOfIterations(iterations);
  pyramid->SetFixedImage(to_itk(fixed));
  pyramid->SetMovingImage(to_itk(moving));
  return pyramid;
}

// A lattice of waves, so that every voxel has a gradient, with a bright blob at the middle plus
// `shift`.
Volume made_cube(int size, double shift) {
  Volume volume;
  volume.grid.size = glm::ivec3(size);
  volume.values.resize(volume.grid.count());
  const glm::dvec3 centre(0.5 * (size - 1));
  for (int k = 0; k < size; ++k) {
    for (int j = 0; j < size; ++j) {
      for (int i = 0; i < size; ++i) {
        const glm::dvec3 x = glm::dvec3(i, j, k) - glm::dvec3(shift, 0, 0);
        const glm::dvec3 r = (x - centre) / (0.2 * size);
        const double waves = std::sin(0.31 * x.x) * std::sin(0.27 * x.y) * std::sin(0.23 * x.z);
        const double blob = std::exp(-0.5 * glm::dot(r, r));
        volume.values[volume.grid.offset(i, j, k)] = float(100.0 * (waves + 4.0 * blob));
      }
    }
  }
  return volume;
}

bool has_samples(const Volume& volume) {
  return volume.grid.count() > 0 && volume.values.size() == volume.grid.count();
}

Error bad_input(std::string message) {
  return {ErrorKind::kBadInput, std::move(message)};
}

}  // namespace

Result<PeerResult> run_itk(const Volume& fixed, const Volume& moving, const PeerOptions& options) {
  if (options.iterations.empty()) {
    return bad_input("ITK was asked for no resolution level: give at least one iteration count.");
  }
  if (!has_samples(fixed) || !has_samples(moving)) {
    return bad_input("An image for ITK holds no samples, or not as many as its grid says.");
  }
  try {
    set_threads(options.threads);
    auto pyramid = make_pyramid(fixed, moving, options);
    const auto start = Clock::now();
    pyramid->Update();
    const double seconds = seconds_since(start);
    return PeerResult{from_itk(*pyramid->GetOutput(), fixed.grid), seconds};
  } catch (const itk::ExceptionObject& failure) {
    return bad_input(std::string("ITK refused to register: ") + failure.GetDescription());
  }
}

Result<ItkRate> itk_demons_rate(int size, int iterations, double sigma_voxels, int threads) {
  if (size < 8 || iterations < 3) {
    return bad_input("The rate of ITK's Demons needs 8 voxels a side and 3 iterations at least.");
  }
  try {
    set_threads(threads);
    auto demons = Demons::New();
    set_smoothing(*demons, sigma_voxels);
    demons->SetFixedImage(to_itk(made_cube(size, 0.0)));
    demons->SetMovingImage(to_itk(made_cube(size, 2.0)));
    demons->SetNumberOfIterations(static_cast<unsigned>(iterations));
    std::vector<std::pair<Clock::time_point, double>> ticks;
    const auto tag = demons->AddObserver(itk::IterationEvent(), [&](const itk::EventObject&) {
      ticks.emplace_back(Clock::now(), demons->GetMetric());
    });
    demons->Update();
    demons->RemoveObserver(tag);
    if (ticks.size() < 3) return bad_input("ITK's Demons stopped before its third iteration.");
    // The metric that ITK reports for an iteration was computed before that iteration's update.
    ItkRate rate;
    const double seconds =
        std::chrono::duration<double>(ticks.back().first - ticks.front().first).count();
    rate.seconds_per_iteration = seconds / double(ticks.size() - 1);
    rate.voxel_iterations_per_s = std::pow(double(size), 3) / rate.seconds_per_iteration;
    rate.mean_square_first = ticks.front().second;
    rate.mean_square_last = ticks.back().second;
    return rate;
  } catch (const itk::ExceptionObject& failure) {
    return bad_input(std::string("ITK refused to register: ") + failure.GetDescription());
  }
}

}  // namespace palpate::peers
