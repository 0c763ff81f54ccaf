#include "tests/lab/bench/contender.h"

namespace palpate::bench {
namespace {

class Palpate final : public Contender {
 public:
  Palpate(const std::shared_ptr<vulkan::Context>& context, std::string name,
          const MotionOptions& options, const peers::KnownPair& pair)
      : name_(std::move(name)) {
    const uint64_t before = context->memory_used_bytes();
    context->reset_memory_peak();
    const double begin = now_s();
    warm_ = std::make_unique<WarmPair>(context, pair.fixed.grid, options);
    const PairRun first = warm_->run(pair.fixed, pair.moving);
    cold_s_ = now_s() - begin;
    device_bytes_ = double(context->memory_peak_bytes() - before);
    demand_same_as_public(context, first, pair.fixed, pair.moving, options);
  }

  Outcome run(const Volume& fixed, const Volume& moving) override {
    const PairRun run = warm_->run(fixed, moving);
    return {resampled(run.field, fixed.grid), run.total_s()};
  }
  std::string name() const override { return name_; }
  double cold_s() const override { return cold_s_; }
  double device_bytes() const override { return device_bytes_; }

 private:
  const std::string name_;
  std::unique_ptr<WarmPair> warm_;
  double cold_s_ = 0.0;
  double device_bytes_ = 0.0;
};

class Itk final : public Contender {
 public:
  explicit Itk(peers::PeerOptions options) : options_(std::move(options)) {}

  Outcome run(const Volume& fixed, const Volume& moving) override {
    auto result = peers::run_itk(fixed, moving, options_);
    if (!result) throw Mismatch(result.error().message);
    return {std::move(result->field), result->seconds};
  }
  std::string name() const override { return "ITK " + peers::described(options_); }

 private:
  const peers::PeerOptions options_;
};

}  // namespace

std::unique_ptr<Contender> palpate_contender(const std::shared_ptr<vulkan::Context>& context,
                                             const std::string& name, const MotionOptions& options,
                                             const peers::KnownPair& pair) {
  return std::make_unique<Palpate>(context, name, options, pair);
}

std::unique_ptr<Contender> itk_contender(const peers::PeerOptions& options) {
  return std::make_unique<Itk>(options);
}

std::vector<peers::PeerOptions> itk_settings(int threads) {
  using peers::ItkGradient;
  using peers::ItkMethod;
  return {
      {ItkMethod::kDiffeomorphic, {50, 50, 30, 20}, 2.0, 0.5, ItkGradient::kWarpedMoving, threads},
      {ItkMethod::kFastSymmetricForces,
       {50, 50, 30, 20},
       2.0,
       0.5,
       ItkGradient::kWarpedMoving,
       threads},
      {ItkMethod::kFastSymmetricForces,
       {20, 20, 15, 3},
       2.0,
       1.0,
       ItkGradient::kWarpedMoving,
       threads}};
}

std::vector<Outcome> alternate(std::vector<std::unique_ptr<Contender>>& contenders,
                               const Volume& fixed, const Volume& moving, int runs) {
  std::vector<Outcome> outcomes(contenders.size());
  std::vector<std::vector<double>> seconds(contenders.size());
  for (int run = 0; run < runs; ++run) {
    for (size_t c = 0; c < contenders.size(); ++c) {
      outcomes[c] = contenders[c]->run(fixed, moving);
      seconds[c].push_back(outcomes[c].seconds);
    }
  }
  for (size_t c = 0; c < contenders.size(); ++c) outcomes[c].seconds = median(seconds[c]);
  return outcomes;
}

}  // namespace palpate::bench
