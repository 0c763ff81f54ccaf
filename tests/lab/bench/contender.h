#pragma once

#include <memory>
#include <string>
#include <vector>

#include "compute/vulkan/context.h"
#include "tests/lab/bench/peers/itk_peers.h"
#include "tests/lab/bench/peers/metaimage_case.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/studies/warm_pair.h"

namespace palpate::bench {

/// What one method gave for one pair.
struct Outcome {
  Field field;  ///< on the fixed image's grid
  double seconds = 0.0;
};

/// A method that registers pairs on one grid. Throws Mismatch if it can not.
class Contender {
 public:
  virtual ~Contender() = default;
  virtual Outcome run(const Volume& fixed, const Volume& moving) = 0;
  virtual std::string name() const = 0;
  /// Seconds of the very first run with all that had to be made ready; 0 if not known.
  virtual double cold_s() const { return 0.0; }
  /// Peak device memory of a pair; 0 if not known.
  virtual double device_bytes() const { return 0.0; }
};

/// palpate with a preset's options, kernels warm from a first run on the given pair. Seconds:
/// conversion, upload, pyramid, solving, download. Demands that this is what estimate_motion()
/// does.
std::unique_ptr<Contender> palpate_contender(const std::shared_ptr<vulkan::Context>& context,
                                             const std::string& name, const MotionOptions& options,
                                             const peers::KnownPair& pair);

/// One of ITK's filters. Seconds: the registration with its pyramid.
std::unique_ptr<Contender> itk_contender(const peers::PeerOptions& options);

/// ITK's filters at the settings that were found best: by accuracy, by accuracy per second.
std::vector<peers::PeerOptions> itk_settings(int threads);

/// Every contender on one pair, `runs` times in alternation, so that a disturbance hits all alike.
/// One result each: the field, and the median of the seconds.
std::vector<Outcome> alternate(std::vector<std::unique_ptr<Contender>>& contenders,
                               const Volume& fixed, const Volume& moving, int runs);

}  // namespace palpate::bench
