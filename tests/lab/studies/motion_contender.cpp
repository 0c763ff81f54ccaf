#include "tests/lab/studies/motion_contender.h"

#include "compute/vulkan/context.h"
#include "tests/lab/studies/motion_work.h"
#include "tests/lab/studies/warm_pair.h"

namespace palpate::studies {
namespace {

class Palpate final : public PairMethod {
 public:
  Palpate(std::shared_ptr<vulkan::Context> context, app::MotionSetting setting)
      : context_(std::move(context)), setting_(std::move(setting)) {}

  Result<PairResult> run(const Volume& fixed, const Volume& moving,
                         const report::Patience& patience) override {
    const bool first = !warm_;
    const uint64_t before = context_->memory_used_bytes();
    if (first) context_->reset_memory_peak();
    if (first) warm_ = std::make_unique<WarmPair>(context_, fixed.grid, setting_.options);
    auto done = warm_->run(fixed, moving, patience.stop);
    if (!done) return Error{ErrorKind::kCancelled, "Stopped."};
    PairRun& run = *done;
    if (first) device_bytes_ = double(context_->memory_peak_bytes() - before);
    // Users call the presets, so these are compared with the public function. All other settings
    // use the same code.
    if (first && setting_.is_preset() && setting_.options.method == MotionMethod::kPalpate)
      demand_same_as_public(context_, run, fixed, moving, setting_.options, patience.stop);
    const double seconds = run.total_s(), work = work_bytes(warm_->plan(), run.report);
    PairResult result{std::move(run.field), seconds, work, device_bytes_};
    if (setting_.options.method == MotionMethod::kPalpate)
      result.confidence = std::move(run.confidence);
    return result;
  }
  std::string name() const override { return setting_.name; }
  std::string family() const override {
    return setting_.is_preset() ? "palpate, presets" : "palpate, other settings";
  }
  bool is_ours() const override { return true; }
  bool is_preset() const override { return setting_.is_preset(); }
  bool is_careful() const override { return setting_.careful; }
  // The paper's method takes tens of times as long on a CPU, so it runs once.
  bool runs_once() const override { return setting_.options.method == MotionMethod::kClassic; }

 private:
  std::shared_ptr<vulkan::Context> context_;
  app::MotionSetting setting_;
  std::unique_ptr<WarmPair> warm_;
  double device_bytes_ = 0.0;
};

}  // namespace

std::unique_ptr<PairMethod> palpate_method(std::shared_ptr<vulkan::Context> context,
                                           app::MotionSetting setting) {
  return std::make_unique<Palpate>(std::move(context), std::move(setting));
}

}  // namespace palpate::studies
