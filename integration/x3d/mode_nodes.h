#pragma once

#include <array>
#include <string_view>

namespace palpate::x3d {

/// The node of a kind of mode. VHTK's own names where they are known; the others are palpate's.
struct ModeNode {
  std::string_view node, kind;
};
inline constexpr std::array<ModeNode, 9> kModeNodes = {{
    {"VectorFollowMode", "follow"},
    {"VectorFrontShapeMode", "front"},
    {"PalpateSurfaceMode", "surface"},
    {"PalpateVortexMode", "vortex"},
    {"PalpateGradientForceMode", "gradient-force"},
    {"PalpateVectorForceMode", "vector-force"},
    {"PalpateAttractorMode", "attractor"},
    {"PalpateTissueMode", "tissue"},
    {"PalpateViscosityMode", "viscosity"},
}};

/// Null for a node that is no mode.
inline const ModeNode* mode_node(std::string_view node) {
  for (const ModeNode& one : kModeNodes)
    if (one.node == node) return &one;
  return nullptr;
}

/// A texture with all frames of a sequence, driven by the fraction of a TimeSensor: the only node
/// for display that palpate adds.
inline constexpr std::string_view kSequenceNode = "PalpateSequenceTexture3D";

/// Metadata with the name of a volume or a mode that is not a valid DEF.
inline constexpr std::string_view kNameMetadata = "palpate name";

}  // namespace palpate::x3d
