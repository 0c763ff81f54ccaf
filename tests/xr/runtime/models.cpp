// Shapes of controllers: XR_EXT_render_model and XR_EXT_interaction_render_model.
#include "tests/xr/runtime/models.h"

#include <cstring>

namespace palpate::test::fake {

// Where the headers have these structures, those of palpate are the same.
#ifdef XR_EXT_render_model
static_assert(sizeof(ModelCreateInfo) == sizeof(XrRenderModelCreateInfoEXT));
static_assert(sizeof(ModelProperties) == sizeof(XrRenderModelPropertiesEXT));
static_assert(sizeof(ModelSpaceCreateInfo) == sizeof(XrRenderModelSpaceCreateInfoEXT));
static_assert(sizeof(ModelStateGetInfo) == sizeof(XrRenderModelStateGetInfoEXT));
static_assert(sizeof(ModelNodeState) == sizeof(XrRenderModelNodeStateEXT));
static_assert(sizeof(ModelState) == sizeof(XrRenderModelStateEXT));
static_assert(sizeof(AssetCreateInfo) == sizeof(XrRenderModelAssetCreateInfoEXT));
static_assert(sizeof(AssetData) == sizeof(XrRenderModelAssetDataEXT));
static_assert(sizeof(AssetNodeProperties) == sizeof(XrRenderModelAssetNodePropertiesEXT));
static_assert(sizeof(AssetProperties) == sizeof(XrRenderModelAssetPropertiesEXT));
static_assert(int(kModelsChangedEvent) ==
              int(XR_TYPE_EVENT_DATA_INTERACTION_RENDER_MODELS_CHANGED_EXT));
#endif

namespace {

constexpr const char* kTrigger = "trigger";

template <class Handle>
XrSession session_of(Kind kind, Handle handle) {
  const std::lock_guard lock(world().mutex);
  const auto at = world().objects.find(id_of(handle));
  return at != world().objects.end() && at->second->kind == kind
             ? handle_of<XrSession>(at->second->parent)
             : XR_NULL_HANDLE;
}

/// Left and right have shapes of their own.
ModelUuid uuid_of(int hand) {
  ModelUuid uuid{};
  uuid[0] = uint8_t(1 + hand);
  return uuid;
}

bool offers_models(const Call& call) {
  return call.instance->extensions.count("XR_EXT_interaction_render_model") > 0;
}

}  // namespace

XrResult xr_EnumerateInteractionRenderModelIdsEXT(XrSession handle,
                                                  const ModelIdsEnumerateInfo* info,
                                                  uint32_t capacity, uint32_t* count,
                                                  ModelId* ids) {
  const Call call("xrEnumerateInteractionRenderModelIdsEXT", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  if (!offers_models(call))
    return w.violation("xrEnumerateInteractionRenderModelIdsEXT: extension",
                       XR_ERROR_FUNCTION_UNSUPPORTED);
  if (int(info->type) != 1000301000)
    return w.violation("xrEnumerateInteractionRenderModelIdsEXT: type");
  std::vector<ModelId> held;
  for (int hand = 0; hand < 2; ++hand)
    if (w.hands[hand] && call.session->synced) held.push_back(ModelId(1 + hand));
  return enumerate(held, capacity, count, ids, [](auto from, auto& to) { to = from; });
}

XrResult xr_CreateRenderModelEXT(XrSession handle, const ModelCreateInfo* create,
                                 ModelHandle* made) {
  const Call call("xrCreateRenderModelEXT", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  if (int(create->type) != 1000300000 || create->gltf_extension_count != 0)
    return w.violation("xrCreateRenderModelEXT: create info");
  if (create->model < 1 || create->model > 2)
    return w.violation("xrCreateRenderModelEXT: id", XrResult(-1000300000));
  RenderModel& model = w.add<RenderModel>(Kind::kRenderModel, call.session->id);
  model.hand = int(create->model) - 1;
  *made = handle_of<ModelHandle>(model.id);
  return XR_SUCCESS;
}

XrResult xr_DestroyRenderModelEXT(ModelHandle handle) {
  const Call call("xrDestroyRenderModelEXT", session_of(Kind::kRenderModel, handle));
  if (!call.session) return call.answer();
  world().remove(id_of(handle));
  return XR_SUCCESS;
}

XrResult xr_GetRenderModelPropertiesEXT(ModelHandle handle, const ModelPropertiesGetInfo* get,
                                        ModelProperties* properties) {
  const Call call("xrGetRenderModelPropertiesEXT", session_of(Kind::kRenderModel, handle));
  if (call.answered()) return call.answer();
  if (int(get->type) != 1000300001 || int(properties->type) != 1000300002)
    return world().violation("xrGetRenderModelPropertiesEXT: type");
  const auto* model = world().find<RenderModel>(Kind::kRenderModel, id_of(handle));
  properties->cache_id = uuid_of(model->hand);
  properties->moving_node_count = 1;
  return XR_SUCCESS;
}

XrResult xr_CreateRenderModelSpaceEXT(XrSession handle, const ModelSpaceCreateInfo* create,
                                      XrSpace* made) {
  const Call call("xrCreateRenderModelSpaceEXT", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  const auto* model = w.find<RenderModel>(Kind::kRenderModel, id_of(create->model));
  if (int(create->type) != 1000300003 || !model)
    return w.violation("xrCreateRenderModelSpaceEXT: model", XR_ERROR_HANDLE_INVALID);
  Space& space = w.add<Space>(Kind::kSpace, call.session->id);
  space.offset = identity();
  space.hand = model->hand;
  space.is_model = true;
  *made = handle_of<XrSpace>(space.id);
  return XR_SUCCESS;
}

XrResult xr_GetRenderModelStateEXT(ModelHandle handle, const ModelStateGetInfo* get,
                                   ModelState* state) {
  const Call call("xrGetRenderModelStateEXT", session_of(Kind::kRenderModel, handle));
  if (call.answered()) return call.answer();
  World& w = world();
  if (int(get->type) != 1000300004 || int(state->type) != 1000300005 || state->count != 1)
    return w.violation("xrGetRenderModelStateEXT: state");
  if (get->display_time <= 0)
    return w.violation("xrGetRenderModelStateEXT: time", XR_ERROR_TIME_INVALID);
  // The trigger is pressed where the setup says so: it goes into the grip.
  state->nodes[0].pose = {{0, 0, 0, 1}, {0, w.setup().trigger_y, 0}};
  state->nodes[0].visible = w.setup().shows_trigger ? XR_TRUE : XR_FALSE;
  return XR_SUCCESS;
}

XrResult xr_CreateRenderModelAssetEXT(XrSession handle, const AssetCreateInfo* create,
                                      AssetHandle* made) {
  const Call call("xrCreateRenderModelAssetEXT", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  if (int(create->type) != 1000300006 || create->cache_id[0] < 1 || create->cache_id[0] > 2)
    return w.violation("xrCreateRenderModelAssetEXT: create info");
  *made =
      handle_of<AssetHandle>(w.add<RenderModelAsset>(Kind::kRenderModelAsset, call.session->id).id);
  return XR_SUCCESS;
}

XrResult xr_DestroyRenderModelAssetEXT(AssetHandle handle) {
  const Call call("xrDestroyRenderModelAssetEXT", session_of(Kind::kRenderModelAsset, handle));
  if (!call.session) return call.answer();
  world().remove(id_of(handle));
  return XR_SUCCESS;
}

XrResult xr_GetRenderModelAssetDataEXT(AssetHandle handle, const AssetDataGetInfo* get,
                                       AssetData* data) {
  const Call call("xrGetRenderModelAssetDataEXT", session_of(Kind::kRenderModelAsset, handle));
  if (call.answered()) return call.answer();
  World& w = world();
  if (int(get->type) != 1000300007 || int(data->type) != 1000300008)
    return w.violation("xrGetRenderModelAssetDataEXT: type");
  return enumerate(w.setup().model, data->capacity, &data->count, data->bytes,
                   [](auto from, auto& to) { to = from; });
}

XrResult xr_GetRenderModelAssetPropertiesEXT(AssetHandle handle, const AssetPropertiesGetInfo* get,
                                             AssetProperties* properties) {
  const Call call("xrGetRenderModelAssetPropertiesEXT",
                  session_of(Kind::kRenderModelAsset, handle));
  if (call.answered()) return call.answer();
  if (int(get->type) != 1000300009 || int(properties->type) != 1000300010 || properties->count != 1)
    return world().violation("xrGetRenderModelAssetPropertiesEXT: properties");
  std::strcpy(properties->nodes[0].name, kTrigger);
  return XR_SUCCESS;
}

}  // namespace palpate::test::fake
