#include "compute/motion/classic.h"

#include <chrono>

#include "compute/motion/gauss.h"

namespace palpate {
namespace {

constexpr int kClassicBatch = 5;

glm::dvec3 sigma_voxels(const MotionPlan& plan, size_t l) {
  const double sigma_mm = plan.options.classic_sigma_mm;
  return sigma_mm > 0.0 ? sigma_mm / plan.levels[l].spacing_mm : glm::dvec3(1.0);
}

}  // namespace

ClassicSolver::ClassicSolver(std::shared_ptr<vulkan::Context> context,
                             std::shared_ptr<MotionKernels> kernels, const MotionPlan& plan)
    : context_(std::move(context)),
      kernels_(std::move(kernels)),
      plan_(plan),
      download_(context_, plan.field.count() * sizeof(glm::vec4),
                vulkan::Buffer::Kind::kHostVisible),
      recorder_(context_) {
  for (const LevelPlan& level : plan_.levels) {
    ClassicLevelImages& images = levels_.emplace_back();
    for (vulkan::Image* image : {&images.field, &images.other}) {
      *image = vulkan::Image(context_, level.image_size, VK_FORMAT_R32G32B32A32_SFLOAT);
      recorder_.prepare(*image);
    }
  }
  recorder_.run();
}

void ClassicSolver::begin_level(size_t l) {
  recorder_.restart();
  if (l + 1 == plan_.levels.size()) {
    kernels_->record_clear(recorder_, levels_[l].field);
  } else {
    const glm::dvec3 scale = 1.0 / glm::dvec3(plan_.levels[l + 1].ratio);
    const glm::ivec3 to = plan_.levels[l].image_size;
    recorder_.dispatch(
        kernels_->upsample(),
        {{levels_[l + 1].field, kernels_->linear()}, levels_[l].field, levels_[l].other},
        shaders::UpsamplePush{glm::ivec4(to, 0), glm::ivec4(plan_.levels[l + 1].image_size, 0),
                              glm::vec4(scale, 0), glm::vec4(0.5 * scale - 0.5, 0)},
        {(to.x + 63) / 64, to.y, to.z});
  }
  recorder_.run();
}

void ClassicSolver::record_iteration(vulkan::Recorder& recorder, size_t l,
                                     const FramePyramid& fixed, const FramePyramid& moving,
                                     const BrickList& bricks, const vulkan::Buffer& list) {
  const LevelPlan& level = plan_.levels[l];
  ClassicLevelImages& images = levels_[l];
  const glm::dvec3 sigma = sigma_voxels(plan_, l);
  // The result of the Gaussian must be in `field`. Each smoothed axis swaps the two images, and so
  // does the force.
  const bool swaps = gauss_swaps(level.image_size, sigma);
  recorder.dispatch(
      kernels_->classic_force(),
      {list,
       {fixed.level(l), kernels_->nearest()},
       {moving.level(l), kernels_->linear()},
       {images.field, kernels_->nearest()},
       swaps ? images.other : images.field},
      shaders::ClassicPush{glm::ivec4(level.image_size, 0), glm::vec4(level.spacing_mm, 0)},
      slice_groups(bricks));
  vulkan::Image& from = swaps ? images.other : images.field;
  vulkan::Image& to = swaps ? images.field : images.other;
  record_gauss(recorder, *kernels_, list, brick_groups(bricks), sigma, {&from}, {&to});
}

std::optional<SolveReport> ClassicSolver::solve(const FramePyramid& fixed,
                                                const FramePyramid& moving,
                                                const std::stop_token& stop,
                                                const SolveProgress& progress) {
  using Clock = std::chrono::steady_clock;
  const auto since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  const auto begin = Clock::now();
  SolveReport report;
  const auto finest = size_t(plan_.options.finest_level);
  for (size_t l = plan_.levels.size(); l-- > finest;) {
    const auto level_begin = Clock::now();
    const LevelPlan& level = plan_.levels[l];
    LevelReport& about = report.levels.emplace_back();
    about.h_mm = level.h_mm;
    begin_level(l);
    const BrickList bricks = all_bricks(level.image_size);
    const vulkan::Buffer list = upload_bricks(context_, bricks);
    int recorded = 0;  // iterations
    while (about.iterations < level.options.iterations) {
      if (stop.stop_requested()) return std::nullopt;
      const int size = std::min(kClassicBatch, level.options.iterations - about.iterations);
      if (size != recorded) {
        recorder_.restart();
        for (int k = 0; k < size; ++k) record_iteration(recorder_, l, fixed, moving, bricks, list);
        recorded = size;
      }
      recorder_.run();
      about.iterations += size;
      // A coarser level has an eighth of the voxels: the finest level is nearly all of the work.
      if (progress && l == finest) progress(double(about.iterations) / level.options.iterations);
    }
    about.brick_iterations = about.all_brick_iterations =
        double(about.iterations) * double(bricks.size());
    about.seconds = since(level_begin);
  }
  recorder_.restart();
  recorder_.copy(levels_[finest].field, download_);
  recorder_.run();
  report.seconds = since(begin);
  return report;
}

void ClassicSolver::download(Field& field, Confidence& confidence) {
  unpack_field(download_.as<glm::vec4>(), plan_, field, confidence);
  std::fill(confidence.values.begin(), confidence.values.end(), 1.0F);
}

}  // namespace palpate
