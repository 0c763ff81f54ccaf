#pragma once

#include "tests/motion/oracle/oracle.h"
#include "tests/support/random.h"

namespace palpate::test {

/// Independent numbers in [-reach, reach) in all four channels.
inline oracle::Texels random_texels(glm::ivec3 size, uint32_t seed, double reach = 1.0) {
  Random random(seed);
  oracle::Texels texels(size);
  for (glm::dvec4& texel : texels.values) {
    texel = glm::dvec4(random.vector(reach), 0.0);
    texel.w = random.draw(-reach, reach);
  }
  return texels;
}

/// Independent vectors with components in [-reach, reach).
inline oracle::Vectors random_vectors(glm::ivec3 size, uint32_t seed, double reach) {
  Random random(seed);
  oracle::Vectors vectors(size);
  for (glm::dvec3& vector : vectors.values) vector = random.vector(reach);
  return vectors;
}

/// Independent numbers in [low, high).
inline oracle::Scalars random_scalars(glm::ivec3 size, uint32_t seed, double low, double high) {
  Random random(seed);
  oracle::Scalars scalars(size);
  for (double& value : scalars.values) value = random.draw(low, high);
  return scalars;
}

/// 1 with the given probability, else 0.
inline oracle::Scalars random_mask(glm::ivec3 size, uint32_t seed, double chance) {
  oracle::Scalars mask = random_scalars(size, seed, 0.0, 1.0);
  for (double& value : mask.values) value = value < chance ? 1.0 : 0.0;
  return mask;
}

}  // namespace palpate::test
