#include "integration/x3d/node_names.h"

#include <algorithm>
#include <array>

#include "integration/files/scene/json_object.h"
#include "integration/files/text.h"
#include "integration/x3d/mode_nodes.h"

namespace palpate::x3d {
namespace {

constexpr std::array<std::string_view, 12> kGroups = {
    "X3D",      "Scene",    "Group",       "StaticGroup", "Anchor",      "Collision",
    "CADLayer", "LayerSet", "CADAssembly", "Layer",       "ToggleGroup", "PickableGroup"};

/// All other nodes that are read, but the modes.
constexpr std::array<std::string_view, 34> kOthers = {"Transform",
                                                      "CADPart",
                                                      "Switch",
                                                      "LOD",
                                                      "Inline",
                                                      "ROUTE",
                                                      "Shape",
                                                      "VolumeData",
                                                      "SegmentedVolumeData",
                                                      "IsoSurfaceVolumeData",
                                                      "VectorVolume",
                                                      "VectorImageVolume",
                                                      "VectorElectroPotential",
                                                      "ScalarElectroPotential",
                                                      "SampledScalarVolume",
                                                      "ImageTexture3D",
                                                      "Image3DTexture",
                                                      kSequenceNode,
                                                      "NrrdImageLoader",
                                                      "DicomImageLoader",
                                                      "RawImageLoader",
                                                      "OpacityMapVolumeStyle",
                                                      "ComposedVolumeStyle",
                                                      "PixelTexture",
                                                      "StreamTubes",
                                                      "StreamRibbons",
                                                      "VolumeHaptics",
                                                      "DeviceInfo",
                                                      "PiecewiseFunction",
                                                      "WindowFunction",
                                                      "TimeSensor",
                                                      "PositionInterpolator",
                                                      "OrientationInterpolator",
                                                      "SplinePositionInterpolator"};

/// Nodes of X3D that are not read, but have names near to some that are.
constexpr std::array<std::string_view, 9> kNoErrors = {"GeoPositionInterpolator",
                                                       "ImageTexture",
                                                       "LineSensor",
                                                       "NurbsOrientationInterpolator",
                                                       "NurbsPositionInterpolator",
                                                       "PixelTexture3D",
                                                       "PositionInterpolator2D",
                                                       "SplinePositionInterpolator2D",
                                                       "SquadOrientationInterpolator"};

}  // namespace

bool is_group(std::string_view name) {
  return std::find(kGroups.begin(), kGroups.end(), name) != kGroups.end();
}

std::string_view meant_node(std::string_view name) {
  constexpr size_t kLongest = 60;
  constexpr size_t kLettersPerEdit = 5;
  if (name.size() > kLongest ||
      std::find(kNoErrors.begin(), kNoErrors.end(), name) != kNoErrors.end())
    return {};
  const std::string lower = files::lowered(name);
  std::string_view best;
  size_t least = kLongest;
  bool is_known = false;
  const auto compare = [&](std::string_view known) {
    is_known = is_known || known == name;
    const size_t edits = files::edits_between(lower, files::lowered(known));
    const size_t most = std::max<size_t>(1, std::max(name.size(), known.size()) / kLettersPerEdit);
    if (edits <= most && edits < least) least = edits, best = known;
  };
  for (const std::string_view known : kGroups) compare(known);
  for (const std::string_view known : kOthers) compare(known);
  for (const ModeNode& mode : kModeNodes) compare(mode.node);
  return is_known ? std::string_view() : best;
}

}  // namespace palpate::x3d
