#include "module/view/ray_lattice.h"

#include <algorithm>

#include "shaders/interface/view.h"

namespace palpate::view {

using namespace view_shaders;

namespace {

// A list's words before its pixels: workgroups along three axes, and how many pixels follow.
constexpr uint32_t kListStart[] = {0, 1, 1, 0};

}  // namespace

RayLattice::RayLattice(std::shared_ptr<vulkan::Context> context, PictureSize most, int most_eyes)
    : points_(context, sizeof(glm::uvec4) * uint64_t((most.width + 1) / 2) *
                           uint64_t((most.height + 1) / 2) * uint64_t(most_eyes)),
      list_(context, sizeof kListStart +
                         4 * uint64_t(most.width) * uint64_t(most.height) * uint64_t(most_eyes)),
      list_start_(context, sizeof kListStart, vulkan::Buffer::Kind::kHostVisible) {
  std::copy(std::begin(kListStart), std::end(kListStart), list_start_.as<uint32_t>().begin());
}

void RayLattice::record(vulkan::Recorder& recorder, Kernels& kernels, PictureSize size, int eyes,
                        const RaycastChoices& choices, const std::vector<vulkan::Binding>& rays,
                        const Pictures& pictures) const {
  const glm::ivec3 groups{(size.width + 15) / 16, (size.height + 15) / 16, eyes};
  recorder.begin_concurrent();
  recorder.copy(list_start_, list_, list_start_.bytes());
  recorder.dispatch(kernels.raycast(choices), rays, RaycastPush{glm::ivec4(kRaysOfLattice)},
                    groups);
  recorder.end_concurrent();
  recorder.dispatch(kernels.between(choices),
                    {pictures.parameters, points_, list_, pictures.thing_depth, pictures.visible,
                     pictures.backdrop, pictures.colour, pictures.depth},
                    nullptr, groups);
  const RaycastPush of_list{glm::ivec4(kRaysOfList)};
  recorder.dispatch_indirect(kernels.raycast(choices), rays, &of_list, list_, 0);
}

}  // namespace palpate::view
