#pragma once

/// Every tolerance of the tests of the motion engine, by name and with its reason. Relative ones
/// are shares of the largest number that takes part.
namespace palpate::test {

/// Stored as fp32, sums of up to about a hundred fp32 products: each rounds by 2^-24, errors of
/// random sign add up as the root of their number, and a factor of 10 for the unlucky order.
inline constexpr double kSingle = 6e-6;

/// Stored as fp16: rounded to nearest, 11 bits, or cut by a device that rounds towards zero.
inline constexpr double kHalf = 1.0 / 1024.0;

/// fp16 has no normal numbers below this; smaller ones may be flushed to zero.
inline constexpr double kHalfSmallest = 6.2e-5;

/// A GPU's texture unit rounds interpolation weights to 8 bits, so that each of the three axes may
/// be off by half of 1/256 of the difference of neighbours, which is at most twice the largest
/// value. A CPU device interpolates in fp32 and gets kSingle.
inline constexpr double kTextureUnit = 3.0 / 256.0;

/// m2 - m1^2 of the local variance cancels: with intensities below 1 the variance is right to a few
/// 1e-7, and with the noise variance 4e-4 below the root that is a relative 1e-3 in the worst case;
/// random images have a variance of about 0.1 and stay far below.
inline constexpr double kNormalised = 2e-5;

/// The inverse of a 3 x 3 by cofactors in fp32: A has eigenvalues up to 1 and the damping 0.04
/// below them, so where A has rank one the determinant cancels to 0.04^2 of its terms, and 6e-8
/// grows to a few 1e-5.
inline constexpr double kUpdate = 1e-4;

/// The smallest eigenvalue in closed form in fp32, in shares of the trace: where the two smaller
/// ones are nearly equal the angle comes from acos near 1, which turns a rounding of 1e-7 into
/// root(2e-7) / 3 = 1.5e-4, and that times root(3) times the spread of up to half the trace.
inline constexpr double kEigenvalue = 3e-4;

/// Determinants near the limit may fall on either side: products of three fp32 sums of numbers of
/// order 1 that were themselves interpolated.
inline constexpr double kDeterminant = 2e-5;

/// Endpoint error of whole estimations of rigid motion of made bodies without noise, in voxels of
/// the finest axis: what is aimed for on real scans with noise, so the least to be asked here.
/// Measured: mean 0.02 to 0.08, p95 0.05 to 0.16.
inline constexpr double kRigidMean = 0.10;
inline constexpr double kRigidP95 = 0.30;

/// The same for scaling: total variation has a price for every slope and flattens it. Measured:
/// mean 0.08 to 0.11, p95 0.22 to 0.31, of a motion of up to 1.7 voxels along each axis.
inline constexpr double kScalingMean = 0.15;
inline constexpr double kScalingP95 = 0.40;

/// The heart phantom at half its resolution (voxels of 2 mm), on the shell, in voxels: its edges
/// are as soft as one voxel there and its bumps as wide as two. Measured 0.22 and 0.23.
inline constexpr double kCoarseHeartMean = 0.30;

/// A single slice of 64 x 64 with noise (SD 1 % of the range), shifted and sheared by up to 4
/// pixels, in pixels: an eighth or so of the voxels of a volume to average over. Measured 0.09 to
/// 0.16; 0.26 to 2.6 with the discrete start on the finest level.
inline constexpr double kSliceMean = 0.20;

/// The sliding phantom: an organ of 96^3 voxels that moves by 20 past a still wall, in the organ
/// and in the wall within 5 voxels of it, voxels. Measured 0.83 and 2.7; without the border
/// step 1.6 and 6.4.
inline constexpr double kSlidingOrganMean = 1.0;
inline constexpr double kSlidingWallMean = 3.2;

/// A field that shows no motion, mm, on voxels of 1 mm: two frames of equal bits differ nowhere, so
/// only the rounding of gradients and filters is left.
inline constexpr double kNoMotion = 1e-4;

}  // namespace palpate::test
