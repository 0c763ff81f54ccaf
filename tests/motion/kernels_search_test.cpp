#include <cmath>

#include "tests/motion/kernel_test.h"

/// The discrete start and the paper's own iteration, against their oracles.
namespace palpate::test {
namespace {

using oracle::Scalars;
using oracle::Texels;
using oracle::Vectors;

int labels_within(glm::ivec3 reach) {
  const glm::ivec3 width = 2 * reach + 1;
  return width.x * width.y * width.z;
}

int count_of(glm::ivec3 nodes) {
  return nodes.x * nodes.y * nodes.z;
}

/// Random costs as a device buffer holds them.
std::vector<Scalars> random_costs(glm::ivec3 nodes, int labels, uint32_t seed) {
  std::vector<Scalars> costs;
  for (int label = 0; label < labels; ++label) {
    Scalars cost = random_scalars(nodes, seed + uint32_t(label), 0.0, 1.0);
    for (double& value : cost.values) value = double(float(value));
    costs.push_back(std::move(cost));
  }
  return costs;
}

class SearchKernelTest : public KernelTest {
 protected:
  vulkan::Buffer buffer(size_t values) {
    return {context(), values * sizeof(float), vulkan::Buffer::Kind::kHostVisible};
  }
  vulkan::Buffer put_costs(const std::vector<Scalars>& costs) {
    vulkan::Buffer result = buffer(costs.size() * costs[0].values.size());
    auto to = result.as<float>().begin();
    for (const Scalars& cost : costs) {
      for (const double value : cost.values) *to++ = float(value);
    }
    return result;
  }
};

class MatchingCostKernel : public SearchKernelTest {};
class SmoothCostKernel : public SearchKernelTest {};
class CoupledChoiceKernel : public SearchKernelTest {};
class ClassicForceKernel : public KernelTest {};

TEST_F(MatchingCostKernel, IsTheMeanCutDifferenceOfEveryLabelAtEveryNode) {
  const glm::ivec3 reach(2, 1, 3);
  const double cut = 0.8;
  uint32_t seed = 900;
  for (const glm::ivec3 size : kSizes) {
    for (const bool holes : {false, true}) {
      SCOPED_TRACE(text(size) + (holes ? " with a mask" : ""));
      const glm::ivec3 cell(4, 3, 2);
      Texels images[2] = {as_stored(random_texels(size, ++seed), Format::kRgba16),
                          as_stored(random_texels(size, ++seed), Format::kRgba16)};
      for (Texels& image : images) {
        const Scalars mask = random_mask(size, ++seed, holes ? 0.5 : 1.0);
        for (size_t i = 0; i < image.values.size(); ++i) {
          if (mask.values[i] == 0.0)
            image.values[i] = glm::dvec4(glm::dvec3(oracle::kOutside), image.values[i].w);
        }
      }
      const std::vector<Scalars> expected =
          oracle::matching_cost(images[0], images[1], cell, reach, cut);
      const glm::ivec3 nodes = oracle::cells_of(size, cell);
      const int labels = labels_within(reach), count = count_of(nodes);
      const DeviceImage fixed = put(images[0], Format::kRgba16);
      const DeviceImage moving = put(images[1], Format::kRgba16);
      vulkan::Buffer cost = buffer(size_t(labels) * size_t(count));
      dispatch(kernels()->matching_cost(), {nearest(fixed), nearest(moving), cost},
               shaders::MatchingPush{glm::ivec4(size, 0), glm::ivec4(nodes, 0), glm::ivec4(cell, 0),
                                     glm::ivec4(reach, 0), glm::vec4(cut, 0, 0, 0)},
               {(count + 63) / 64, labels, 1});
      for (int label = 0; label < labels; ++label) {
        for (int n = 0; n < count; ++n) {
          ASSERT_NEAR(cost.as<float>()[size_t(label * count + n)],
                      expected[size_t(label)].values[size_t(n)], 2.0 * kSingle)
              << "label " << text(oracle::label_of(label, reach)) << " node " << n;
        }
      }
    }
  }
}

TEST_F(SmoothCostKernel, WeighsNeighboursOneTwoOneAndHoldsTheBorder) {
  uint32_t seed = 950;
  for (const glm::ivec3 nodes : kSizes) {
    for (int axis = 0; axis < 3; ++axis) {
      SCOPED_TRACE(text(nodes) + " axis " + std::to_string(axis));
      const std::vector<Scalars> costs = random_costs(nodes, 5, seed += 5);
      const int count = count_of(nodes);
      const vulkan::Buffer from = put_costs(costs);
      vulkan::Buffer to = buffer(5 * size_t(count));
      dispatch(kernels()->smooth_cost(), {from, to},
               shaders::SmoothCostPush{glm::ivec4(nodes, axis)}, {(count + 63) / 64, 5, 1});
      for (size_t label = 0; label < 5; ++label) {
        const Scalars expected = oracle::smooth_cost(costs[label], axis);
        for (size_t n = 0; n < expected.values.size(); ++n)
          ASSERT_NEAR(to.as<float>()[label * size_t(count) + n], expected.values[n], kSingle);
      }
    }
  }
}

TEST_F(CoupledChoiceKernel, TakesTheCheapestLabelAtAPriceForLeavingTheSmoothField) {
  const glm::ivec3 reach(2, 1, 1);
  const glm::dvec3 spacing_mm(0.7, 1.1, 2.5);
  const int labels = labels_within(reach);
  for (const bool first : {true, false}) {
    for (const glm::ivec3 nodes : kSizes) {
      SCOPED_TRACE(text(nodes) + (first ? " first round" : " later round"));
      const double price = first ? 1e-4 : 0.05;
      const std::vector<Scalars> costs = random_costs(nodes, labels, 980);
      Vectors u = random_vectors(nodes, 990, 2.0);
      u = vectors_of(as_stored(texels_of(u), Format::kRgba32));
      const vulkan::Buffer cost = put_costs(costs);
      const DeviceImage field = put(texels_of(u), Format::kRgba32);
      const DeviceImage choice = output(nodes, Format::kRgba32);
      dispatch(kernels()->coupled_choice(), {cost, nearest(field), choice.image},
               shaders::CoupledChoicePush{glm::ivec4(nodes, 0), glm::ivec4(reach, first ? 1 : 0),
                                          glm::vec4(spacing_mm, price)},
               {(count_of(nodes) + 63) / 64, 1, 1});
      const Vectors chosen = vectors_of(get(choice));
      oracle::for_each(nodes, [&](glm::ivec3 node) {
        const glm::dvec3 near = first ? glm::dvec3(0.0) : u.at(node) / spacing_mm;
        const auto costs_now = [&](int label) {
          return oracle::coupled_cost(costs, label, node, reach, near, price);
        };
        double best = 1e30, paid = 1e30;
        for (int label = 0; label < labels; ++label) {
          best = std::min(best, costs_now(label));
          const glm::dvec3 mm = spacing_mm * glm::dvec3(oracle::label_of(label, reach));
          if (glm::distance(mm, chosen.at(node)) < kSingle * 5.0) paid = costs_now(label);
        }
        // Equals within rounding may win either way.
        EXPECT_NEAR(paid, best, 2.0 * kSingle) << text(node) << " took " << text(chosen.at(node));
      });
    }
  }
}

TEST_F(ClassicForceKernel, IsThePapersStepInUnitsOfTheVoxel) {
  const glm::dvec3 spacing_mm(0.7, 1.1, 2.5);
  uint32_t seed = 1000;
  for (const glm::ivec3 size : kSizes) {
    SCOPED_TRACE(text(size));
    const Texels fixed = as_stored(random_texels(size, ++seed), Format::kRgba32);
    const Texels moving = as_stored(random_texels(size, ++seed), Format::kRgba32);
    Vectors u = random_vectors(size, ++seed, 3.0);
    u = vectors_of(as_stored(texels_of(u), Format::kRgba32));
    const Vectors expected = oracle::classic_force(fixed, moving, u, spacing_mm);
    const BrickList bricks = all_bricks(size);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    const DeviceImage f = put(fixed, Format::kRgba32);
    const DeviceImage m = put(moving, Format::kRgba32);
    const DeviceImage field = put(texels_of(u), Format::kRgba32);
    const DeviceImage to = output(size, Format::kRgba32);
    dispatch(kernels()->classic_force(), {list, nearest(f), linear(m), nearest(field), to.image},
             shaders::ClassicPush{glm::ivec4(size, 0), glm::vec4(spacing_mm, 0)},
             slice_groups(bricks));
    // d / |g| magnifies the error of d where both are small; random gradients are rarely below 0.1.
    expect_all(to, texels_of(expected), 3, 4.0, 10.0 * sampling_tolerance());
  }
}

TEST_F(ClassicForceKernel, LeavesTheFieldOutsideTheMaskAndWhereNothingIsToBeSeen) {
  const glm::ivec3 size(9, 7, 8);
  Texels fixed(size);
  for (size_t i = 0; i < fixed.values.size(); ++i) {
    if (i % 2) fixed.values[i] = glm::dvec4(glm::dvec3(oracle::kOutside), 0.7);
  }
  const Vectors u(size, glm::dvec3(0.25, -0.5, 1.0));
  const BrickList bricks = all_bricks(size);
  const vulkan::Buffer list = upload_bricks(context(), bricks);
  const DeviceImage f = put(fixed, Format::kRgba16);
  const DeviceImage m = put(Texels(size), Format::kRgba16);
  const DeviceImage field = put(texels_of(u), Format::kRgba32);
  const DeviceImage to = output(size, Format::kRgba32);
  dispatch(kernels()->classic_force(), {list, nearest(f), linear(m), nearest(field), to.image},
           shaders::ClassicPush{glm::ivec4(size, 0), glm::vec4(1.0F)}, slice_groups(bricks));
  EXPECT_EQ(vectors_of(get(to)).values, u.values);
}

}  // namespace
}  // namespace palpate::test
