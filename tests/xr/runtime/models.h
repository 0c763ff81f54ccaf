#pragma once

#include "module/xr/newer_openxr.h"
#include "tests/xr/runtime/world.h"

namespace palpate::test::fake {

using namespace palpate::xr;  // the structures of newer_openxr.h

XrResult xr_EnumerateInteractionRenderModelIdsEXT(XrSession handle,
                                                  const ModelIdsEnumerateInfo* info,
                                                  uint32_t capacity, uint32_t* count, ModelId* ids);
XrResult xr_CreateRenderModelEXT(XrSession handle, const ModelCreateInfo* create,
                                 ModelHandle* made);
XrResult xr_DestroyRenderModelEXT(ModelHandle handle);
XrResult xr_GetRenderModelPropertiesEXT(ModelHandle handle, const ModelPropertiesGetInfo* get,
                                        ModelProperties* properties);
XrResult xr_CreateRenderModelSpaceEXT(XrSession handle, const ModelSpaceCreateInfo* create,
                                      XrSpace* made);
XrResult xr_GetRenderModelStateEXT(ModelHandle handle, const ModelStateGetInfo* get,
                                   ModelState* state);
XrResult xr_CreateRenderModelAssetEXT(XrSession handle, const AssetCreateInfo* create,
                                      AssetHandle* made);
XrResult xr_DestroyRenderModelAssetEXT(AssetHandle handle);
XrResult xr_GetRenderModelAssetDataEXT(AssetHandle handle, const AssetDataGetInfo* get,
                                       AssetData* data);
XrResult xr_GetRenderModelAssetPropertiesEXT(AssetHandle handle, const AssetPropertiesGetInfo* get,
                                             AssetProperties* properties);

}  // namespace palpate::test::fake
