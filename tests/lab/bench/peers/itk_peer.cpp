// ITK's Demons filters as a program of their own: palpate-lab runs it beside palpate, and must
// never be linked with ITK's registration.
//   palpate_itk_peer demons|symmetric|fast|diffeomorphic ITERATIONS THREADS FIXED MOVING FIELD
// One registration. ITERATIONS: one number per level from coarse to fine, "50,50,30,20". It writes
// the field and prints the seconds of the registration alone, without files.
//   palpate_itk_peer rate SIZE THREADS
// Prints the seconds of one iteration of plain Demons on SIZE^3 voxels.

#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "integration/files/raster/write_field.h"
#include "integration/files/read_volume.h"
#include "tests/lab/bench/peers/itk_peers.h"

namespace {

using palpate::peers::ItkGradient;
using palpate::peers::ItkMethod;
using palpate::peers::PeerOptions;

int fail(const std::string& why) {
  fmt::print(stderr, "palpate_itk_peer: {}\n", why);
  return 2;
}

/// The best settings found for each filter.
bool setting_of(const std::string& name, PeerOptions& options) {
  options.sigma_voxels = 2.0;
  options.max_step_voxels = 0.5;
  options.gradient = ItkGradient::kWarpedMoving;
  if (name == "demons") {
    options.method = ItkMethod::kDemons;
    options.gradient = ItkGradient::kFixed;
  } else if (name == "symmetric") {
    options.method = ItkMethod::kSymmetricForces;
  } else if (name == "fast") {
    options.method = ItkMethod::kFastSymmetricForces;
  } else if (name == "diffeomorphic") {
    options.method = ItkMethod::kDiffeomorphic;
  } else {
    return false;
  }
  return true;
}

/// "50,50,30,20"; empty if a number is missing or zero.
std::vector<unsigned> numbers(const std::string& text) {
  std::vector<unsigned> result;
  std::istringstream in(text);
  for (std::string word; std::getline(in, word, ',');) {
    const int value = std::atoi(word.c_str());
    if (value < 1) return {};
    result.push_back(unsigned(value));
  }
  return result;
}

int rate(int size, int threads) {
  constexpr int kIterations = 12;
  constexpr double kSigma = 1.0;
  if (size < 16 || threads < 1) return fail("give a size of 16 or more and a number of threads.");
  const auto found = palpate::peers::itk_demons_rate(size, kIterations, kSigma, threads);
  if (!found) return fail(found.error().message);
  if (!(found->mean_square_last < found->mean_square_first))
    return fail("Demons did not register its pair, so its rate means nothing.");
  fmt::print("{:.6f}\n", found->seconds_per_iteration);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 4 && std::string(argv[1]) == "rate")
    return rate(std::atoi(argv[2]), std::atoi(argv[3]));
  if (argc != 7) return fail("give METHOD ITERATIONS THREADS FIXED MOVING FIELD.");
  PeerOptions options;
  if (!setting_of(argv[1], options))
    return fail(std::string("there is no method '") + argv[1] + "'.");
  options.iterations = numbers(argv[2]);
  if (options.iterations.empty()) return fail("the iterations must be numbers like 50,50,30,20.");
  options.threads = std::atoi(argv[3]);
  if (options.threads < 1) return fail("the number of threads must be 1 or more.");
  const auto fixed = palpate::files::read_volume(argv[4]);
  if (!fixed) return fail(fixed.error().message);
  const auto moving = palpate::files::read_volume(argv[5]);
  if (!moving) return fail(moving.error().message);
  const auto result = palpate::peers::run_itk(*fixed, *moving, options);
  if (!result) return fail(result.error().message);
  const auto written = palpate::files::write_field(result->field, argv[6]);
  if (!written) return fail(written.error().message);
  fmt::print("{:.6f}\n", result->seconds);
  return 0;
}
