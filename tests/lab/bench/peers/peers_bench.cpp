// Prints what ITK's Demons filters reach on a pair whose motion is known, and what an iteration
// costs them. Usage: peers_bench [PREFIX], where PREFIX_fixed.mha, _moving.mha, _truth.mha and
// _body.mha are the pair.

#include <cstdio>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "compute/volume/field.h"
#include "tests/lab/bench/peers/itk_peers.h"
#include "tests/lab/bench/peers/metaimage_case.h"

namespace {

using palpate::peers::ItkGradient;
using palpate::peers::ItkMethod;
using palpate::peers::PeerOptions;

// The settings that were found best for each filter, by accuracy and by accuracy per second.
std::vector<PeerOptions> rows() {
  const std::vector<unsigned> longest = {50, 50, 30, 20};
  const std::vector<unsigned> quick = {20, 20, 15, 3};
  return {
      {ItkMethod::kDiffeomorphic, longest, 2.0, 0.5, ItkGradient::kWarpedMoving, 2},
      {ItkMethod::kFastSymmetricForces, longest, 2.0, 0.5, ItkGradient::kWarpedMoving, 2},
      {ItkMethod::kFastSymmetricForces, longest, 2.0, 0.5, ItkGradient::kSymmetric, 2},
      {ItkMethod::kFastSymmetricForces, quick, 2.0, 1.0, ItkGradient::kWarpedMoving, 2},
      {ItkMethod::kSymmetricForces, longest, 2.0, 0.5, ItkGradient::kSymmetric, 2},
      {ItkMethod::kDemons, longest, 2.0, 0.5, ItkGradient::kFixed, 2},
  };
}

void print_row(const std::string& name, const palpate::peers::EndpointError& error,
               double seconds) {
  fmt::print("{:<58} {:>8.3f} {:>6.2f} {:>10.3f} {:>6.2f} {:>9.2f}\n", name, error.mean_voxels,
             error.p95_voxels, error.mean_finest, error.p95_finest, seconds);
  std::fflush(stdout);
}

// A time means nothing if the answer is wrong.
palpate::Error worse_than_nothing(const PeerOptions& options) {
  return {palpate::ErrorKind::kBadInput, palpate::peers::described(options) +
                                             " is worse than no motion: give a pair that it can "
                                             "register."};
}

int fail(const palpate::Error& error) {
  fmt::print(stderr, "peers_bench: {}\n", error.message);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  namespace peers = palpate::peers;
  const std::string prefix = argc > 1 ? argv[1] : std::string(PALPATE_SHARED_DATA) + "/lung/pair";
  const auto pair = peers::read_known_pair(prefix);
  if (!pair) return fail(pair.error());

  fmt::print("{:<58} {:>15} {:>17} {:>9}\n", "ITK 5.2, 2 threads", "voxels of axis",
             "voxels of finest", "seconds");
  fmt::print("{:<58} {:>8} {:>6} {:>10} {:>6}\n", "endpoint error inside the body", "mean", "p95",
             "mean", "p95");
  const palpate::Field still{pair->fixed.grid, std::vector<glm::vec3>(pair->fixed.grid.count())};
  const auto nothing = peers::endpoint_error(still, *pair);
  print_row("doing nothing", nothing, 0.0);
  for (const PeerOptions& options : rows()) {
    const auto result = peers::run_itk(pair->fixed, pair->moving, options);
    if (!result) return fail(result.error());
    const auto error = peers::endpoint_error(result->field, *pair);
    print_row(peers::described(options), error, result->seconds);
    if (error.mean_voxels >= nothing.mean_voxels) return fail(worse_than_nothing(options));
  }

  for (const double sigma_voxels : {1.0, 2.0}) {
    const auto rate = peers::itk_demons_rate(128, 12, sigma_voxels, 2);
    if (!rate) return fail(rate.error());
    fmt::print(
        "plain Demons, 128^3, sigma {}: {:.1f} million voxel-iterations/s, {:.0f} ms each, "
        "mean square {:.0f} -> {:.0f}\n",
        sigma_voxels, 1e-6 * rate->voxel_iterations_per_s, 1e3 * rate->seconds_per_iteration,
        rate->mean_square_first, rate->mean_square_last);
  }
  return 0;
}
