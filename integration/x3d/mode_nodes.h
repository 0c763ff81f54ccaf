#pragma once

#include <array>
#include <string_view>

namespace palpate::x3d {

/// The node of a kind of mode. VHTK's own names are used where they are known; the others are
/// palpate's.
struct ModeNode {
  std::string_view node, kind;
};
inline constexpr std::array<ModeNode, 8> kModeNodes = {{
    {"VectorFollowMode", "follow"},
    {"VectorFrontShapeMode", "front"},
    {"PalpateSurfaceMode", "surface"},
    {"PalpateVortexMode", "vortex"},
    {"PalpateGradientForceMode", "gradient-force"},
    {"PalpateVectorForceMode", "vector-force"},
    {"PalpateAttractorMode", "attractor"},
    {"PalpateTissueMode", "tissue"},
}};

/// Null for a node that is no mode.
inline const ModeNode* mode_node(std::string_view node) {
  for (const ModeNode& one : kModeNodes)
    if (one.node == node) return &one;
  return nullptr;
}

/// A texture of all frames of a sequence, which a TimeSensor's fraction drives: the one node that
/// palpate adds for the eye.
inline constexpr std::string_view kSequenceNode = "PalpateSequenceTexture3D";

/// Metadata that give a volume or a mode a name that can not be a DEF.
inline constexpr std::string_view kNameMetadata = "palpate name";

}  // namespace palpate::x3d
