#include "module/view/repacker.h"

#include "compute/vulkan/tried.h"
#include "spirv/view/repack.h"

namespace palpate {
namespace {

struct Packing {
  VkFormat format;
  bool swapped, linear, half;
};
constexpr Packing kPackings[] = {{VK_FORMAT_R8G8B8A8_SRGB, false, false, false},
                                 {VK_FORMAT_B8G8R8A8_SRGB, true, false, false},
                                 {VK_FORMAT_R8G8B8A8_UNORM, false, true, false},
                                 {VK_FORMAT_B8G8R8A8_UNORM, true, true, false},
                                 {VK_FORMAT_R16G16B16A16_SFLOAT, false, true, true}};

const Packing* packing_of(VkFormat format) {
  for (const Packing& packing : kPackings)
    if (packing.format == format) return &packing;
  return nullptr;
}

constexpr int kGroup = 64;

}  // namespace

bool Repacker::can(VkFormat format) {
  return packing_of(format) != nullptr;
}

Result<std::unique_ptr<Repacker>> Repacker::make(std::shared_ptr<vulkan::Context> context,
                                                 VkFormat format, PictureSize most, int eyes) {
  return vulkan::tried([&] {
    return std::unique_ptr<Repacker>(new Repacker(std::move(context), format, most, eyes));
  });
}

Repacker::Repacker(std::shared_ptr<vulkan::Context> context, VkFormat format, PictureSize most,
                   int eyes)
    : context_(std::move(context)), format_(format), eyes_(eyes) {
  assert(can(format) && "this format can not be made");
  const Packing& packing = *packing_of(format);
  vulkan::KernelOptions options;
  options.spirv = k_view_repack;
  options.push_bytes = sizeof(glm::ivec4);
  options.specialisation = {packing.swapped, packing.linear, packing.half};
  kernel_ = vulkan::Kernel(context_, options);
  repacked_ = vulkan::Buffer(
      context_, uint64_t(eyes) * pixel_bytes() * uint64_t(most.width) * uint64_t(most.height));
  recorder_ = std::make_unique<vulkan::Recorder>(context_, 1);
}

uint64_t Repacker::pixel_bytes() const {
  return packing_of(format_)->half ? 8 : 4;
}

Repacker::~Repacker() {
  // The device must have finished with what is freed below, also after an error.
  (void)vulkan::tried([&] { recorder_->wait(); });
}

Status Repacker::start(const vulkan::Buffer& colours, PictureSize size) {
  const int rows = eyes_ * size.height;
  return vulkan::tried([&] {
    recorder_->restart();
    recorder_->dispatch(kernel_, {colours, repacked_}, glm::ivec4(size.width, rows, 0, 0),
                        {(size.width + kGroup - 1) / kGroup, rows, 1});
    recorder_->start();
  });
}

}  // namespace palpate
