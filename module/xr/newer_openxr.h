#pragma once

#include <openxr/openxr.h>

#include <array>
#include <cstdint>

/// What the headers of Debian 12 (OpenXR 1.0.20) do not declare, with the numbers of Khronos'
/// registry (xr.xml); not for other folders.
namespace palpate::xr {

// XR_EXT_local_floor, extension 427
inline constexpr const char* kLocalFloorExtension = "XR_EXT_local_floor";
inline constexpr XrReferenceSpaceType kLocalFloorSpace = XrReferenceSpaceType(1000426000);

// XR_EXT_hand_interaction, extension 303: paths only
inline constexpr const char* kHandInteractionExtension = "XR_EXT_hand_interaction";
inline constexpr const char* kHandInteractionProfile =
    "/interaction_profiles/ext/hand_interaction_ext";

// XR_EXT_uuid, extension 300; XR_EXT_render_model, 301; XR_EXT_interaction_render_model, 302. The
// names are palpate's own: newer headers have those of Khronos.
inline constexpr const char* kUuidExtension = "XR_EXT_uuid";
inline constexpr const char* kRenderModelExtension = "XR_EXT_render_model";
inline constexpr const char* kInteractionRenderModelExtension = "XR_EXT_interaction_render_model";
inline constexpr XrResult kModelIdInvalid = XrResult(-1000300000);
inline constexpr XrStructureType kModelsChangedEvent = XrStructureType(1000301002);

using ModelId = uint64_t;  ///< XrRenderModelIdEXT
using ModelUuid = std::array<uint8_t, 16>;
using ModelHandle = struct RenderModelObject*;       ///< XrRenderModelEXT
using AssetHandle = struct RenderModelAssetObject*;  ///< XrRenderModelAssetEXT

/// Structures that carry nothing but their type.
template <int32_t kType>
struct TypedStructure {
  XrStructureType type = XrStructureType(kType);
  const void* next = nullptr;
};
using ModelPropertiesGetInfo = TypedStructure<1000300001>;
using AssetDataGetInfo = TypedStructure<1000300007>;
using AssetPropertiesGetInfo = TypedStructure<1000300009>;
using ModelIdsEnumerateInfo = TypedStructure<1000301000>;

struct ModelCreateInfo {
  XrStructureType type = XrStructureType(1000300000);
  const void* next = nullptr;
  ModelId model = 0;
  uint32_t gltf_extension_count = 0;
  const char* const* gltf_extensions = nullptr;
};
struct ModelProperties {
  XrStructureType type = XrStructureType(1000300002);
  void* next = nullptr;
  ModelUuid cache_id{};
  uint32_t moving_node_count = 0;
};
struct ModelSpaceCreateInfo {
  XrStructureType type = XrStructureType(1000300003);
  const void* next = nullptr;
  ModelHandle model = nullptr;
};
struct ModelStateGetInfo {
  XrStructureType type = XrStructureType(1000300004);
  const void* next = nullptr;
  XrTime display_time = 0;
};
struct ModelNodeState {
  XrPosef pose{};
  XrBool32 visible = XR_FALSE;
};
struct ModelState {
  XrStructureType type = XrStructureType(1000300005);
  void* next = nullptr;
  uint32_t count = 0;
  ModelNodeState* nodes = nullptr;
};
struct AssetCreateInfo {
  XrStructureType type = XrStructureType(1000300006);
  const void* next = nullptr;
  ModelUuid cache_id{};
};
struct AssetData {
  XrStructureType type = XrStructureType(1000300008);
  void* next = nullptr;
  uint32_t capacity = 0, count = 0;
  uint8_t* bytes = nullptr;
};
struct AssetNodeProperties {
  char name[64]{};
};
struct AssetProperties {
  XrStructureType type = XrStructureType(1000300010);
  void* next = nullptr;
  uint32_t count = 0;
  AssetNodeProperties* nodes = nullptr;
};

using EnumerateModelIds = XrResult(XRAPI_PTR*)(XrSession, const ModelIdsEnumerateInfo*, uint32_t,
                                               uint32_t*, ModelId*);
using CreateModel = XrResult(XRAPI_PTR*)(XrSession, const ModelCreateInfo*, ModelHandle*);
using DestroyModel = XrResult(XRAPI_PTR*)(ModelHandle);
using GetModelProperties = XrResult(XRAPI_PTR*)(ModelHandle, const ModelPropertiesGetInfo*,
                                                ModelProperties*);
using CreateModelSpace = XrResult(XRAPI_PTR*)(XrSession, const ModelSpaceCreateInfo*, XrSpace*);
using GetModelState = XrResult(XRAPI_PTR*)(ModelHandle, const ModelStateGetInfo*, ModelState*);
using CreateAsset = XrResult(XRAPI_PTR*)(XrSession, const AssetCreateInfo*, AssetHandle*);
using DestroyAsset = XrResult(XRAPI_PTR*)(AssetHandle);
using GetAssetData = XrResult(XRAPI_PTR*)(AssetHandle, const AssetDataGetInfo*, AssetData*);
using GetAssetProperties = XrResult(XRAPI_PTR*)(AssetHandle, const AssetPropertiesGetInfo*,
                                                AssetProperties*);

/// The functions of the three extensions: all of them, or none.
struct ModelFunctions {
  EnumerateModelIds enumerate_ids = nullptr;
  CreateModel create = nullptr;
  DestroyModel destroy = nullptr;
  GetModelProperties get_properties = nullptr;
  CreateModelSpace create_space = nullptr;
  GetModelState get_state = nullptr;
  CreateAsset create_asset = nullptr;
  DestroyAsset destroy_asset = nullptr;
  GetAssetData get_asset_data = nullptr;
  GetAssetProperties get_asset_properties = nullptr;
  explicit operator bool() const { return enumerate_ids != nullptr; }
};

}  // namespace palpate::xr
