// What the view's kernels and C++ share: push constants, the parameters of a frame, and the words
// of the skip structure. Only 16-byte members, so that both lay them out the same way.
#ifndef PALPATE_SHADERS_INTERFACE_VIEW_H
#define PALPATE_SHADERS_INTERFACE_VIEW_H

#ifdef __cplusplus
#include <glm/glm.hpp>
namespace palpate::view_shaders {
using glm::ivec4;
using glm::uvec4;
using glm::vec4;
#define PALPATE_SIZE(type, bytes) static_assert(sizeof(type) == (bytes))
#define PALPATE_CONSTANT constexpr
#else
#define PALPATE_SIZE(type, bytes)
#define PALPATE_CONSTANT const
#endif

PALPATE_CONSTANT int kBrick = 8;        // voxels along the edge of a brick: the unit of skipping
PALPATE_CONSTANT int kNode = 4;         // voxels between back-tracked nodes
PALPATE_CONSTANT int kMostVolumes = 8;  // in one picture, including surfaces of segments
PALPATE_CONSTANT int kMostPlanes = 8;   // that clip
PALPATE_CONSTANT int kMostEyes = 4;     // headsets may have a second, narrower pair
PALPATE_CONSTANT int kTable = 2048;  // entries of a transfer table, each with colour and extinction
// Words per brick: the first one (see kSolid); two with a bit for each of its 64 blocks of 2 x 2 x
// 2 cells that shows anything. Two with a bit for each block of which every cell does; 16 with a
// bit for each cell. Bit x + 4 y + 16 z of blocks, x + 8 y + 64 z of cells, from the lowest bit on.
PALPATE_CONSTANT int kSkipWords = 21;
PALPATE_CONSTANT int kBlockWord = 1;
PALPATE_CONSTANT int kFullBlockWord = 3;
PALPATE_CONSTANT int kCellWord = 5;
PALPATE_CONSTANT int kFarthest = 63;  // bricks that can be skipped at once
PALPATE_CONSTANT int kPart = 4;       // cells along the edge of a part for which bounds are stored
PALPATE_CONSTANT int kMostLevels = 12;   // levels of the table of maxima over 2^l entries
PALPATE_CONSTANT int kPrefilterRun = 8;  // voxels along x that an invocation computes
PALPATE_CONSTANT int kStride = 4;        // steps per segment where a volume is thin
PALPATE_CONSTANT int kMostTerms = 41;    // of a motion for a whole sequence: TimeWeights::kMost
PALPATE_CONSTANT int kLightLevels = 5;   // of the light grid, each with half the cells of the last
// Distances, in the first skip word of a brick: bricks to the nearest one that is occupied (bits 0
// to 7), not solid (8 to 15), not thin (16 to 23); 0 if the brick itself is so. While the word is
// being made it holds the flags below.
#ifdef __cplusplus
constexpr unsigned kSolid = 0x100U;  // nothing is skipped in it, and it is not thin
constexpr unsigned kThin = 0x200U;   // it absorbs little light, so longer steps suffice
#else
const uint kSolid = 0x100u;
const uint kThin = 0x200u;
#endif

// A ray of an eye: the point at depth t (m along the eye's viewing direction) is origin + t (first
// + x right + y down), x and y in pixels from the centre of the first pixel.
struct ViewRays {
  vec4 origin;
  vec4 first;
  vec4 right;
  vec4 down;
};

struct ViewVolumeParameters {
  ViewRays rays[kMostEyes];  // in voxels of the volume
  vec4 size;                 // voxels; w: 1 if the volume is drawn
  ivec4 bricks;              // along each axis; w: first word of its skip structure
  vec4 spacing_mm;           // of its voxels, w: samples along a ray per mm
  vec4 table;  // x, y: entry = x * value + y; z: first entry; w: slope (1/mm) of a full surface
  vec4 shine;  // ambient, diffuse, specular; w: share of the extinction where values are flat
  vec4 light;  // towards the light, along the volume's axes (of voxels)
  vec4 head;   // towards the eyes, in the same axes
  // normal = stretch * slope, for volumes scaled differently along the axes; w: 1/2 if the volume
  // is read as in curve.comp, else 0
  vec4 stretch;
};

struct ViewParameters {
  // In the world, m; w of first and down: of the first pixel, and per row, how far down the
  // background's gradient it is, 0 to 1.
  ViewRays rays[kMostEyes];
  vec4 planes[8];                  // a point is kept where dot(xyz, point) >= w; world, m
  vec4 background;                 // linear colour; w: nearest depth t, m
  vec4 background_low;             // at the bottom; w: farthest depth t of any volume, m
  vec4 light;                      // towards the light, world; w: steps that samples are moved
  ivec4 counts;                    // eyes, planes, width, height
  vec4 backdrop;                   // of a host's picture: 1 / t = x + y d, 1/m, for its depth d
  ViewRays light_rays[kMostEyes];  // in cells of the light grid, see light.comp
  vec4 light_planes[8];            // planes, in cells
  vec4 light_way;                  // towards the light, along the axes of the cells
  vec4 light_cells;                // along each axis; w: share of the light that can be taken
  vec4 smooth_below;  // of each eye: RendererOptions::smooth, or 0 to draw rays of all pixels
  ViewVolumeParameters volumes[8];
};
PALPATE_SIZE(ViewRays, 64);
PALPATE_SIZE(ViewVolumeParameters, 384);
PALPATE_SIZE(ViewParameters, 3968);

// A round cone: the union of all spheres between two, with centre and radius blended.
struct ViewThing {
  vec4 from;  // world, m; w: radius
  vec4 to;
  vec4 colour;  // linear
};
PALPATE_SIZE(ViewThing, 48);

// edge length of the part of a picture that a workgroup draws
PALPATE_CONSTANT int kItemPixels = 64;

struct MeshVertex {
  vec4 at;       // of the mesh, m
  vec4 normal;   // of any length
  vec4 texture;  // x, y: 0 to 1 from the texture's upper left corner
};
PALPATE_SIZE(MeshVertex, 48);

// A mesh where it is now.
struct MeshPart {
  vec4 world_from_mesh[3];  // rows: world = row . (place, 1)
  ivec4 first;              // triangle, vertex
  ivec4 texture;            // first texel, width, height, levels; width 0: none
  vec4 colour;              // linear
};
PALPATE_SIZE(MeshPart, 96);
PALPATE_CONSTANT int kItemTriangles = 64;  // that a workgroup draws

PALPATE_CONSTANT int kItemBits = 14;            // of a pixel's coordinate in a list
PALPATE_CONSTANT int kMostListGroups = 0x8000;  // along x
PALPATE_CONSTANT int kRaysOfAllPixels = 0;
PALPATE_CONSTANT int kRaysOfLattice = 1;
PALPATE_CONSTANT int kRaysOfList = 2;
struct RaycastPush {
  ivec4 rays;  // x: of which pixels
};
PALPATE_SIZE(RaycastPush, 16);

struct PrefilterPush {
  ivec4 size;
  // x, y: weight of the middle sample and of each neighbour; z, w: value = z * sum + w
  vec4 weights;
};
PALPATE_SIZE(PrefilterPush, 32);

struct MotionAtPush {
  ivec4 size;  // samples of the field; w: number of terms
};
PALPATE_SIZE(MotionAtPush, 16);

struct MotionBlendPush {
  ivec4 size;           // samples of the field
  vec4 before_from[3];  // rows: index of the field before = row . (index of the field, 1)
  vec4 share;           // x: of the field after
};
PALPATE_SIZE(MotionBlendPush, 80);

struct TrackPush {
  ivec4 nodes;         // along each axis; w: 1 = start from the nodes of the last phase
  ivec4 field_size;    // samples of the field
  vec4 field_from[3];  // rows: index of the field = row . (voxel, 1)
  // x: g; y: largest accepted error, voxels; z: 1 = of a motion for all times (track.comp); w: 1 =
  // nodes before a brick's first one are read
  vec4 phase;
  ivec4 bricks;
};
PALPATE_SIZE(TrackPush, 112);

struct PartRange {
  vec4 values;   // least and greatest value of the frame, least and greatest of the next one
  vec4 least_u;  // voxels
  vec4 most_u;
};
PALPATE_SIZE(PartRange, 48);

struct RangesPush {
  ivec4 size;  // voxels; w: 1 = there is a field
  ivec4 parts;
  ivec4 field_size;
  vec4 field_from[3];  // rows: index of the field = row . (voxel, 1)
};
PALPATE_SIZE(RangesPush, 96);

struct MarkPush {
  ivec4 parts;
  ivec4 bricks;
  vec4 table;          // x, y: entry = x * value + y; z: first entry of the table; w: last one
  vec4 phase;          // x: of the motion; y: weight of the next frame; z: 1 = nodes are read
  ivec4 field_size;    // samples of the field, if it is read
  vec4 field_from[3];  // rows: index of the field = row . (voxel, 1)
};
PALPATE_SIZE(MarkPush, 128);

struct BrickPush {
  ivec4 size;
  ivec4 bricks;  // w: first word of the skip structure
  vec4 nodes;    // of the back-tracked nodes
  // x, y: weight of frame and next frame; z: a brick with less extinction (1/mm) is thin; w: 1 /
  // phase
  vec4 frames;
  vec4 table;   // as in MarkPush
  vec4 per_mm;  // voxels per mm along each axis
};
PALPATE_SIZE(BrickPush, 96);

struct BricksPush {
  ivec4 bricks;  // w: first word of the skip structure
};
PALPATE_SIZE(BricksPush, 16);

struct LightDensityPush {
  ivec4 cells;              // of the light grid; w: 1 = add to what is there
  vec4 voxel_from_cell[3];  // rows: voxel = row . (cell, 1)
  vec4 volume;              // x: its number in the parameters; y: edge of a cell in the volume, mm
};
PALPATE_SIZE(LightDensityPush, 80);

struct LightHalvePush {
  ivec4 cells;  // of the coarser level
};
PALPATE_SIZE(LightHalvePush, 16);

#ifdef __cplusplus
#undef PALPATE_SIZE
#undef PALPATE_CONSTANT
}  // namespace palpate::view_shaders
#endif
#endif
