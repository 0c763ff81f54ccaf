#include <cmath>

#include "tests/motion/equation_images.h"
#include "tests/motion/kernel_test.h"

/// The discrete start and the iteration of the classic method, against their oracles.
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

/// Random costs as a device buffer stores them.
std::vector<Scalars> random_costs(glm::ivec3 nodes, int labels, uint32_t seed) {
  std::vector<Scalars> costs;
  for (int label = 0; label < labels; ++label) {
    Scalars cost = random_scalars(nodes, seed + uint32_t(label), 0.0, 1.0);
    for (double& value : cost.values) value = double(float(value));
    costs.push_back(std::move(cost));
  }
  return costs;
}

/// All nodes but every third one, or all.
struct Listed {
  Listed(const std::shared_ptr<vulkan::Context>& context, glm::ivec3 nodes, bool all)
      : mask(nodes, 1.0) {
    const auto count = size_t(count_of(nodes));
    std::vector<int32_t> place(count, -1);
    for (size_t n = 0; n < count; ++n) {
      if (!all && n % 3 == 1) {
        mask.values[n] = 0.0;
        continue;
      }
      place[n] = int32_t(numbers.size());
      numbers.push_back(uint32_t(n));
    }
    list = vulkan::Buffer(context, count * sizeof(uint32_t), vulkan::Buffer::Kind::kHostVisible);
    places = vulkan::Buffer(context, count * sizeof(int32_t), vulkan::Buffer::Kind::kHostVisible);
    std::copy(numbers.begin(), numbers.end(), list.as<uint32_t>().begin());
    std::copy(place.begin(), place.end(), places.as<int32_t>().begin());
  }
  int count() const { return int(numbers.size()); }

  Scalars mask;
  std::vector<uint32_t> numbers;
  vulkan::Buffer list, places;
};

class SearchKernelTest : public KernelTest {
 protected:
  vulkan::Buffer buffer(size_t values) {
    return {context(), values * sizeof(float), vulkan::Buffer::Kind::kHostVisible};
  }
  /// The costs of the listed nodes.
  vulkan::Buffer put_costs(const std::vector<Scalars>& costs, const Listed& listed) {
    vulkan::Buffer result = buffer(costs.size() * listed.numbers.size());
    auto to = result.as<float>().begin();
    for (const Scalars& cost : costs) {
      for (const uint32_t n : listed.numbers) *to++ = float(cost.values[n]);
    }
    return result;
  }
};

class MatchingCostKernel : public SearchKernelTest {};
class SmoothCostKernel : public SearchKernelTest {};
class CoupledChoiceKernel : public SearchKernelTest {};
class ChooseKernel : public KernelTest {};
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
      const glm::ivec3 nodes = oracle::cells_of(size, cell);
      const glm::dvec3 spacing_mm(0.5, 1.0, 2.0);
      Vectors base = random_vectors(nodes, ++seed, 2.0);
      base = vectors_of(as_stored(texels_of(base), Format::kRgba32));
      Vectors base_voxels = base;
      for (glm::dvec3& u : base_voxels.values) u /= spacing_mm;
      const std::vector<Scalars> expected =
          oracle::matching_cost(images[0], images[1], base_voxels, cell, reach, cut);
      const Listed listed(context(), nodes, !holes);
      const int labels = labels_within(reach), count = listed.count();
      const DeviceImage field = put(texels_of(base), Format::kRgba32);
      const DeviceImage fixed = put(images[0], Format::kRgba16);
      const DeviceImage moving = put(images[1], Format::kRgba16);
      vulkan::Buffer cost = buffer(size_t(labels) * size_t(count));
      dispatch(
          kernels()->matching_cost(),
          {listed.list, nearest(fixed), nearest(moving), nearest(field), cost},
          shaders::MatchingPush{glm::ivec4(size, 0), glm::ivec4(nodes, count), glm::ivec4(cell, 0),
                                glm::ivec4(reach, 0), glm::vec4(spacing_mm, cut)},
          {(count + 63) / 64, labels, 1});
      for (int label = 0; label < labels; ++label) {
        for (int n = 0; n < count; ++n) {
          ASSERT_NEAR(cost.as<float>()[size_t(label * count + n)],
                      expected[size_t(label)].values[listed.numbers[size_t(n)]], 2.0 * kSingle)
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
      for (const bool all : {true, false}) {
        SCOPED_TRACE(text(nodes) + " axis " + std::to_string(axis) + (all ? "" : " with gaps"));
        const std::vector<Scalars> costs = random_costs(nodes, 5, seed += 5);
        const Listed listed(context(), nodes, all);
        const int count = listed.count();
        const vulkan::Buffer from = put_costs(costs, listed);
        vulkan::Buffer to = buffer(5 * size_t(count));
        dispatch(kernels()->smooth_cost(), {listed.list, listed.places, from, to},
                 shaders::SmoothCostPush{glm::ivec4(nodes, axis), {count, 0, 0, 0}},
                 {(count + 63) / 64, 5, 1});
        for (size_t label = 0; label < 5; ++label) {
          const Scalars expected = oracle::smooth_cost(costs[label], listed.mask, axis);
          for (size_t n = 0; n < size_t(count); ++n)
            ASSERT_NEAR(to.as<float>()[label * size_t(count) + n],
                        expected.values[listed.numbers[n]], kSingle);
        }
      }
    }
  }
}

TEST_F(CoupledChoiceKernel, TakesTheCheapestLabelAtAPriceForLeavingTheSmoothField) {
  const glm::ivec3 reach(2, 1, 1);
  const glm::dvec3 spacing_mm(0.7, 1.1, 2.5);
  const int labels = labels_within(reach);
  const double price = 0.05;
  for (const bool all : {true, false}) {
    for (const glm::ivec3 nodes : kSizes) {
      SCOPED_TRACE(text(nodes) + (all ? "" : " with gaps"));
      const std::vector<Scalars> costs = random_costs(nodes, labels, 980);
      const auto stored = [&](uint32_t seed) {
        return vectors_of(as_stored(texels_of(random_vectors(nodes, seed, 2.0)), Format::kRgba32));
      };
      const Vectors u = stored(990), base = stored(991);
      const Listed listed(context(), nodes, all);
      const vulkan::Buffer cost = put_costs(costs, listed);
      const DeviceImage field = put(texels_of(u), Format::kRgba32);
      const DeviceImage from = put(texels_of(base), Format::kRgba32);
      const DeviceImage choice = output(nodes, Format::kRgba32);
      dispatch(kernels()->coupled_choice(),
               {listed.places, cost, nearest(field), nearest(from), choice.image},
               shaders::CoupledChoicePush{glm::ivec4(nodes, listed.count()), glm::ivec4(reach, 0),
                                          glm::vec4(spacing_mm, price)},
               {(count_of(nodes) + 63) / 64, 1, 1});
      const Vectors chosen = vectors_of(get(choice));
      const auto strides = glm::ivec3(1, 2 * reach.x + 1, (2 * reach.x + 1) * (2 * reach.y + 1));
      oracle::for_each(nodes, [&](glm::ivec3 node) {
        if (listed.mask.at(node) == 0.0) {
          EXPECT_EQ(chosen.at(node), base.at(node)) << text(node);
          return;
        }
        const glm::dvec3 whole = glm::round(base.at(node) / spacing_mm);
        const glm::dvec3 near = u.at(node) / spacing_mm - whole;
        const auto costs_now = [&](int label) {
          return oracle::coupled_cost(costs, label, node, reach, near, price);
        };
        // The displacement of a label, with the sub-voxel part from the costs of its neighbours.
        const auto meant_mm = [&](int label) {
          const glm::ivec3 steps = oracle::label_of(label, reach);
          if (steps == glm::ivec3(0)) return base.at(node);
          glm::dvec3 voxels = whole + glm::dvec3(steps);
          for (int a = 0; a < 3; ++a) {
            if (std::abs(steps[a]) == reach[a]) continue;
            voxels[a] += oracle::lowest_between(costs[size_t(label - strides[a])].at(node),
                                                costs[size_t(label)].at(node),
                                                costs[size_t(label + strides[a])].at(node));
          }
          return spacing_mm * voxels;
        };
        double best = 1e30, paid = 1e30;
        for (int label = 0; label < labels; ++label) {
          best = std::min(best, costs_now(label));
          // The sub-voxel part magnifies rounding if three costs are nearly equal.
          if (glm::distance(meant_mm(label), chosen.at(node)) < 1e-3) paid = costs_now(label);
        }
        // Of labels whose costs are equal within rounding, any may be chosen.
        EXPECT_NEAR(paid, best, 2.0 * kSingle) << text(node) << " took " << text(chosen.at(node));
      });
    }
  }
}

TEST_F(ChooseKernel, TakesTheFieldThatLeavesLessAndNotTheOneWhosePartnersAreGone) {
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    const auto equations = [&](uint32_t seed) {
      EquationImages images = images_of(random_equations(cells, seed));
      images[2] = as_stored(images[2], Format::kRgba16);
      return images;
    };
    const EquationImages now = equations(1020), then = equations(1021);
    const auto stored = [&](uint32_t seed) {
      return vectors_of(as_stored(texels_of(random_vectors(cells, seed, 4.0)), Format::kRgba32));
    };
    const Vectors u = stored(1022), other = stored(1023);
    const Vectors expected =
        oracle::choose(equations_of(now), equations_of(then), u, other, -0.25F, 0.5F, 0.3F);
    const BrickList bricks = all_bricks(cells);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    const DeviceImage a = put(now[2], Format::kRgba16), b = put(then[2], Format::kRgba16);
    const DeviceImage field = put(texels_of(u), Format::kRgba32);
    const DeviceImage from = put(texels_of(other), Format::kRgba32);
    const DeviceImage to = output(cells, Format::kRgba32);
    const DeviceImage as_well = output(cells, Format::kRgba32);
    dispatch(kernels()->choose(),
             {list, nearest(a), nearest(b), nearest(field), nearest(from), to.image, as_well.image},
             shaders::ChoosePush{glm::ivec4(cells, 0), {-0.25F, 0.5F, 0.3F, 0}},
             slice_groups(bricks));
    expect_all(to, texels_of(expected), 3, 4.0, 20.0 * kSingle);
    expect_all(as_well, texels_of(expected), 3, 4.0, 20.0 * kSingle);
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
    // d / |g| magnifies the error of d if both are small; random gradients are rarely below 0.1.
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
