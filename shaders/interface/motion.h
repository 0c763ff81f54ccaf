// Push constants of the motion kernels, shared by GLSL and C++. Only 16-byte members, so that both
// lay them out the same way; C++ asserts the sizes.
#ifndef PALPATE_SHADERS_INTERFACE_MOTION_H
#define PALPATE_SHADERS_INTERFACE_MOTION_H

#ifdef __cplusplus
#include <glm/glm.hpp>
namespace palpate::shaders {
using glm::ivec4;
using glm::vec4;
#define PALPATE_SIZE(type, bytes) static_assert(sizeof(type) == (bytes))
// Cells along each edge of a brick, the unit of leaving work out. A workgroup is one slice of a
// brick.
constexpr int kBrick = 8;
// Largest number of taps of a smoothing kernel on one side of its centre.
constexpr int kMaxRadius = 11;
// Gradients are clamped to this, in 1/mm, so that they are finite in fp16; an infinite gradient
// marks a voxel outside the mask.
constexpr float kLargestGradient = 60000.0F;
// An axis with fewer voxels than this has no outermost voxels that do not count, see pack.comp.
constexpr int kLeastForOutermost = 16;
// A level may yield fully where the determinant of its field is above kGentle, and not at all below
// kSteepest.
constexpr float kSteepest = 0.5F;
constexpr float kGentle = 0.8F;
// A window that was chosen adds nothing where a smaller share of its voxels counts than kFew, and
// all of its step above kMost.
constexpr float kFew = 0.5F;
constexpr float kMost = 0.9F;
// Deviation and confidence, see confidence.comp and docs/decisions/motion/confidence.md. kAlong,
// kAcross, kErrorRadius and kErrorTail were fitted on 57 pairs of 9 anatomies with known motion.
constexpr float kAlong = 1.55F;
constexpr float kAcross = 1.84F;
constexpr float kGuess = 1.0F;
constexpr float kErrorRadius = 1.71F;
constexpr float kErrorTail = 1.85F;
constexpr float kRest = 0.03F;
constexpr float kRestDamping = 0.03F;
constexpr float kSteep = 0.1F;
constexpr float kCertain = 0.01F;
constexpr float kUnknown = 10.0F;
constexpr float kCounts = 0.01F;
constexpr float kLeastShare = 0.05F;
// White noise of two frames that share nothing gives gradients of r^2 / 8 per voxel and axis; a
// quarter more removes chance variations, too.
constexpr float kNoiseOfGradient = 0.15625F;
constexpr float kLeastResidual = 1e-6F;
// Candidates of the step for sliding borders per axis and side.
constexpr int kSlidingSteps = 4;
#else
#define PALPATE_SIZE(type, bytes)
const int kBrick = 8;
const int kMaxRadius = 11;
const float kLargestGradient = 60000.0;
const int kLeastForOutermost = 16;
const float kSteepest = 0.5;
const float kGentle = 0.8;
const float kFew = 0.5;
const float kMost = 0.9;
const float kAlong = 1.55;
const float kAcross = 1.84;
const float kGuess = 1.0;
const float kErrorRadius = 1.71;
const float kErrorTail = 1.85;
const float kRest = 0.03;
const float kRestDamping = 0.03;
const float kSteep = 0.1;
const float kCertain = 0.01;
const float kUnknown = 10.0;
const float kCounts = 0.01;
const float kLeastShare = 0.05;
const float kNoiseOfGradient = 0.15625;
const float kLeastResidual = 1e-6;
const int kSlidingSteps = 4;
#endif

struct DownsamplePush {
  ivec4 fine_size;    // of the bound image; w: its first slice in the whole
  ivec4 coarse_size;  // of the whole; w: first slice to write
  ivec4 ratio;  // fine voxels per coarse voxel along each axis, 1 or 2; w: slices to write, 0 = all
};
PALPATE_SIZE(DownsamplePush, 48);

struct MomentsPush {
  ivec4 size;   // of the image
  ivec4 cells;  // of the moments
  ivec4 cell;   // voxels per cell
  ivec4 begin;  // first cell that is written
};
PALPATE_SIZE(MomentsPush, 64);

struct GaussPush {
  ivec4 size;       // of the image smoothed; w: axis 0, 1, 2
  ivec4 radius;     // x: taps on one side
  vec4 weights[3];  // weight of tap 0, 1, ... kMaxRadius
};
PALPATE_SIZE(GaussPush, 80);

struct NormalisePush {
  ivec4 size;
  ivec4 cells;  // of the moments
  ivec4 cell;   // voxels per moments cell
  vec4 noise;   // x: f^2, the noise variance; y: 1 = normalise locally, 0 = keep the intensity
  ivec4 begin;  // first voxel that is written
};
PALPATE_SIZE(NormalisePush, 80);

struct PackPush {
  ivec4 size;  // of the bound image; w: slices of the whole, 0 = its outermost voxels count
  vec4 spacing_mm;
  // First voxel that is written; w: slice of the whole that the bound image begins with.
  ivec4 begin;
};
PALPATE_SIZE(PackPush, 48);

struct NormalEquationsPush {
  // of the field; w: colour of the checkerboard that is read, 0 or 1; -1 = every voxel
  ivec4 cells;
  ivec4 fixed_size;   // of the fixed image; w: z of the first slice that the bound slab holds
  ivec4 moving_size;  // of the moving image; w: z of the first slice that the bound slab holds
  // x: slices in the bound slab; y, z: first and last + 1 sample floor(z) that this slab computes;
  // w: 1 = add to the output, 0 = write
  ivec4 moving_slab;
  ivec4 fixed_slab;  // x: slices in the bound slab; y, z: first and last + 1 slice of it that count
  vec4 spacing_mm;   // of the images
};
PALPATE_SIZE(NormalEquationsPush, 96);

struct UpdatePush {
  ivec4 cells;
  vec4 cell_mm;
  vec4 step;  // x: alpha^2 / h^2 in 1/mm^2; y: largest |d| in mm
};
PALPATE_SIZE(UpdatePush, 48);

struct LeaveOutPush {
  ivec4 cells;  // w: the part that is left out, 0 or 1; -1: none
};
PALPATE_SIZE(LeaveOutPush, 16);

struct SharedNoisePush {
  ivec4 cells;
  vec4 voxels;  // x: of a cell
};
PALPATE_SIZE(SharedNoisePush, 32);

struct LeftOutErrorPush {
  ivec4 cells;  // w: the part that was left out
  vec4 factor;  // x: of the error
};
PALPATE_SIZE(LeftOutErrorPush, 32);

struct WindowSharePush {
  ivec4 cells;
  vec4 share;  // x, y: gain, relative to the structure, at which the share leaves 0 and reaches 1
};
PALPATE_SIZE(WindowSharePush, 32);

struct UpdateTwoPush {
  ivec4 cells;
  vec4 cell_mm;
  vec4 step;  // x, y: alpha^2 / h^2 in 1/mm^2 for s = 0 and s = 1; z: largest |d| in mm
  // x, y: rho at which s leaves 0 and reaches 1; z: W, r^2 that noise leaves without structure; w:
  // flat
  vec4 share;
  // x: factor on the total variation for s = 1; y: T at which it is halved; z: voxels that the
  // narrow window averages; w: 1 = a share was chosen
  vec4 filter_weight;
};
PALPATE_SIZE(UpdateTwoPush, 80);

struct TotalVariationPush {
  ivec4 cells;
  vec4 slope;  // per axis: weight of the difference of neighbours
  // x: lambda h in mm where .w of the field is 0; y: dual step; z: Huber threshold in mm; w:
  // momentum
  vec4 weight;
};
PALPATE_SIZE(TotalVariationPush, 48);

struct ClearPush {
  ivec4 size;
};
PALPATE_SIZE(ClearPush, 16);

struct UpsamplePush {
  ivec4 to_cells;
  ivec4 from_cells;
  vec4 scale;  // index in `from` = scale * index in `to` + offset
  vec4 offset;
};
PALPATE_SIZE(UpsamplePush, 64);

struct MeasurePush {
  ivec4 cells;
  vec4 unit;  // x: 1 / (length in mm of one unit)
};
PALPATE_SIZE(MeasurePush, 32);

struct ConfidencePush {
  ivec4 cells;
  vec4 cell_mm;  // w: 1 / h in 1/mm
  // xyz: kNoiseOfGradient / (voxel edge in mm)^2; w: 1 / (voxels averaged by the window, times h^2)
  vec4 noise;
};
PALPATE_SIZE(ConfidencePush, 48);

struct MatchingPush {
  ivec4 size;       // of the images
  ivec4 nodes;      // w: listed nodes
  ivec4 cell;       // voxels per node
  ivec4 reach;      // labels go from -reach to +reach voxels along each axis
  vec4 spacing_mm;  // of the images; w: larger differences are cut to this
};
PALPATE_SIZE(MatchingPush, 80);

struct SmoothCostPush {
  ivec4 nodes;  // w: axis
  ivec4 count;  // x: listed nodes
};
PALPATE_SIZE(SmoothCostPush, 32);

struct CoupledChoicePush {
  ivec4 nodes;  // w: listed nodes
  ivec4 reach;  // labels go from -reach to +reach voxels along each axis
  // of the images; w: price of one squared voxel of distance from the smooth field
  vec4 spacing_mm;
};
PALPATE_SIZE(CoupledChoicePush, 48);

struct ChoosePush {
  ivec4 cells;
  vec4 gain;  // x, y: gain at which the other field begins to be taken, and is taken fully; z: flat
};
PALPATE_SIZE(ChoosePush, 32);

struct ClassicPush {
  ivec4 size;
  vec4 spacing_mm;
};
PALPATE_SIZE(ClassicPush, 32);

struct FoldsPush {
  ivec4 cells;  // w: 1 at the voxels, too; 0 at the cells' middles only
  ivec4 cell;   // image voxels per cell
  ivec4 image_size;
  vec4 spacing_mm;  // of the image; w: smallest determinant allowed
};
PALPATE_SIZE(FoldsPush, 64);

struct BlendPush {
  ivec4 cells;  // w: 1 = all cells of the bricks, 0 = those that touch a fold
};
PALPATE_SIZE(BlendPush, 16);

struct SlidingFindPush {
  ivec4 cells;
  ivec4 ratio;   // finer cells per cell
  ivec4 bricks;  // of the finer cells
  ivec4 step;    // cells from candidate to candidate along each axis
  vec4 cell_mm;
  vec4 different;  // across a border: x: least difference in mm; y: least difference / distance
};
PALPATE_SIZE(SlidingFindPush, 96);

struct SlidingMomentsPush {
  ivec4 cells;
  ivec4 cell;       // voxels per cell
  ivec4 size;       // of the images
  vec4 spacing_mm;  // of the images
};
PALPATE_SIZE(SlidingMomentsPush, 64);

struct SlidingCostPush {
  ivec4 cells;
  ivec4 cell;       // voxels per cell
  ivec4 size;       // of the images
  vec4 spacing_mm;  // of the images; w: 1 / limit^2 of a difference of intensities
  ivec4 coarse;     // voxels that the cells of the moments cover, also beyond the image
  ivec4 step;       // cells from candidate to candidate along each axis; w: the first candidate
  vec4 noise;       // x: f^2, the noise variance
  vec4 different;   // across a border: x: least difference in mm; y: least difference / distance
};
PALPATE_SIZE(SlidingCostPush, 128);

struct SlidingWorkPush {
  ivec4 cells;
  ivec4 step;  // cells from candidate to candidate along each axis
  // x: share of the own cost, and y: cost, by which a candidate must be better; z: cost that noise
  // explains
  vec4 cost;
  vec4 cell_mm;
  vec4 different;  // across a border: x: least difference in mm; y: least difference / distance
};
PALPATE_SIZE(SlidingWorkPush, 80);

struct SlidingChoosePush {
  ivec4 cells;  // w: the first candidate
  ivec4 step;   // cells from candidate to candidate along each axis
  vec4 cell_mm;
  vec4 different;  // across a border: x: least difference in mm; y: least difference / distance
};
PALPATE_SIZE(SlidingChoosePush, 64);

struct SlidingTakePush {
  ivec4 cells;
  ivec4 step;  // cells between candidates along each axis
};
PALPATE_SIZE(SlidingTakePush, 32);

struct MedianPush {
  ivec4 cells;
};
PALPATE_SIZE(MedianPush, 16);

struct BlendAlongPush {
  ivec4 cells;  // w: length of d in cells
  vec4 cell_mm;
};
PALPATE_SIZE(BlendAlongPush, 32);

#ifdef __cplusplus
#undef PALPATE_SIZE
}  // namespace palpate::shaders
#endif
#endif
