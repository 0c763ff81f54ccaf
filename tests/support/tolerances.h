#pragma once

/// All tolerances of the motion engine's tests, each with its reason. Relative ones are fractions
/// of the largest number that takes part.
namespace palpate::test {

/// Stored as fp32, sums of up to about a hundred fp32 products. Each rounds by 2^-24; errors of
/// random sign add up with the root of their number; a factor of 10 is for an unfavourable order.
inline constexpr double kSingle = 6e-6;

/// Stored as fp16: rounded to nearest, 11 bits, or cut by a device that rounds towards zero.
inline constexpr double kHalf = 1.0 / 1024.0;

/// fp16 has no normal numbers below this; smaller ones may be flushed to zero.
inline constexpr double kHalfSmallest = 6.2e-5;

/// A GPU's texture unit rounds interpolation weights to 8 bits. So along each of the three axes the
/// error is at most half of 1/256 of the difference of neighbours, which is at most twice the
/// largest value. A CPU device interpolates in fp32 and gets kSingle.
inline constexpr double kTextureUnit = 3.0 / 256.0;

/// m2 - m1^2 of the local variance cancels. With intensities below 1 the variance is right to a few
/// 1e-7; with the noise variance 4e-4 added before the root this is a relative 1e-3 in the worst
/// case. Random images have a variance of about 0.1, and their error is far smaller.
inline constexpr double kNormalised = 2e-5;

/// The inverse of a 3 x 3 matrix by cofactors in fp32. A has eigenvalues up to 1, with the damping
/// 0.04 added. Where A has rank one the determinant cancels to 0.04^2 of its terms, and 6e-8 grows
/// to a few 1e-5.
inline constexpr double kUpdate = 1e-4;

/// The smallest eigenvalue in closed form in fp32, as a fraction of the trace. Where the two
/// smaller ones are nearly equal the angle is acos of a number near 1, which changes a rounding of
/// 1e-7 into root(2e-7) / 3 = 1.5e-4; multiply by root(3) and by the spread of up to half the
/// trace.
inline constexpr double kEigenvalue = 3e-4;

/// A determinant closer to the limit than this may be on either side: products of three fp32 sums
/// of numbers of order 1 that were themselves interpolated.
inline constexpr double kDeterminant = 2e-5;

/// Endpoint error of whole estimations of rigid motion of synthetic bodies without noise, in voxels
/// of the finest axis. The limits are the targets for real scans with noise, so these tests must
/// reach them at least. Measured: mean 0.02 to 0.08, p95 0.05 to 0.16.
inline constexpr double kRigidMean = 0.10;
inline constexpr double kRigidP95 = 0.30;

/// The same for scaling: total variation penalises every slope and so flattens it. Measured: mean
/// 0.08 to 0.11, p95 0.22 to 0.31, of a motion of up to 1.7 voxels along each axis.
inline constexpr double kScalingMean = 0.15;
inline constexpr double kScalingP95 = 0.40;

/// The heart phantom at half its resolution (voxels of 2 mm), on the shell, in voxels. Its edges
/// are one voxel soft there and its bumps two voxels wide. Measured 0.22 and 0.23.
inline constexpr double kCoarseHeartMean = 0.30;

/// A single slice of 64 x 64 with noise (SD 1 % of the range), shifted and sheared by up to 4
/// pixels, in pixels. It has about an eighth of the voxels of a volume to average over. Measured
/// 0.09 to 0.16; 0.26 to 2.6 with the discrete start on the finest level.
inline constexpr double kSliceMean = 0.20;

/// The sliding phantom: an organ of 96^3 voxels that moves by 20 voxels past a still wall. Mean
/// error in the organ, and in the wall within 5 voxels of the organ, in voxels. Measured 0.77 and
/// 2.5; without the border step 1.6 and 6.4.
inline constexpr double kSlidingOrganMean = 1.0;
inline constexpr double kSlidingWallMean = 3.2;

/// A displacement that counts as none, mm, on voxels of 1 mm: between two equal frames, and across
/// the plane of a single slice. Only the rounding of gradients and filters remains there.
inline constexpr double kNoMotion = 1e-4;

}  // namespace palpate::test
