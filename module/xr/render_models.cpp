#include "module/xr/render_models.h"

#include <algorithm>
#include <cstring>

#include "module/xr/spaces.h"

namespace palpate::xr {

Outcome<std::vector<HeldModel>> RenderModels::read(const OpenXrSession& session, XrSpace base,
                                                   XrTime time, const Pose& world_from_base) {
  if (works() && !known_) {
    const Done asked = ask(session);
    if (!asked) {
      const Done refused = refuse(asked.error());
      if (!refused) return refused.error();
    }
  }
  auto located = locate_all(base, time, world_from_base);
  if (located) return located;
  const Done refused = refuse(located.error());
  if (!refused) return refused.error();
  return std::vector<HeldModel>();
}

/// Keeps the models that are still there, forgets the others, and makes the new ones.
Done RenderModels::ask(const OpenXrSession& session) {
  constexpr const char* kCall = "xrEnumerateInteractionRenderModelIdsEXT";
  const ModelIdsEnumerateInfo info;
  uint32_t count = 0;
  Done asked = done(kCall, functions_.enumerate_ids(session.handle(), &info, 0, &count, nullptr));
  if (!asked) return asked;
  std::vector<ModelId> ids(count);
  asked = done(kCall, functions_.enumerate_ids(session.handle(), &info, count, &count, ids.data()));
  if (!asked) return asked;
  ids.resize(count);
  std::erase_if(models_, [&](const KnownModel& model) {
    return std::find(ids.begin(), ids.end(), model.id) == ids.end();
  });
  for (const ModelId id : ids) {
    if (std::any_of(models_.begin(), models_.end(),
                    [&](const KnownModel& m) { return m.id == id; }))
      continue;
    auto made = make(session, id);
    // Switched off in between: an event will say so.
    if (!made && made.error().result == int(kModelIdInvalid)) continue;
    if (!made) return made.error();
    models_.push_back(std::move(*made));
  }
  known_ = true;
  return Nothing{};
}

Outcome<RenderModels::KnownModel> RenderModels::make(const OpenXrSession& session,
                                                     ModelId id) const {
  KnownModel model;
  model.id = id;
  model.handle = ExtensionHandle<ModelHandle>(functions_.destroy);
  ModelCreateInfo create;
  create.model = id;
  Done made = done("xrCreateRenderModelEXT",
                   functions_.create(session.handle(), &create, model.handle.out()));
  if (!made) return made.error();
  const ModelPropertiesGetInfo get;
  ModelProperties properties;
  made = done("xrGetRenderModelPropertiesEXT",
              functions_.get_properties(model.handle.get(), &get, &properties));
  if (!made) return made.error();
  ModelSpaceCreateInfo space;
  space.model = model.handle.get();
  made = done("xrCreateRenderModelSpaceEXT",
              functions_.create_space(session.handle(), &space, model.space.out()));
  if (!made) return made.error();
  model.cache_id = properties.cache_id;
  for (const KnownModel& known : models_)
    if (known.cache_id == model.cache_id) model.asset = known.asset;
  if (!model.asset) {
    auto asset = asset_of(session, properties);
    if (!asset) return asset.error();
    model.asset = std::move(*asset);
  }
  return model;
}

Outcome<std::shared_ptr<const ModelAsset>> RenderModels::asset_of(
    const OpenXrSession& session, const ModelProperties& properties) const {
  ExtensionHandle<AssetHandle> handle(functions_.destroy_asset);
  AssetCreateInfo create;
  create.cache_id = properties.cache_id;
  Done read = done("xrCreateRenderModelAssetEXT",
                   functions_.create_asset(session.handle(), &create, handle.out()));
  if (!read) return read.error();
  constexpr const char* kDataCall = "xrGetRenderModelAssetDataEXT";
  const AssetDataGetInfo get_data;
  AssetData data;
  read = done(kDataCall, functions_.get_asset_data(handle.get(), &get_data, &data));
  if (!read) return read.error();
  auto asset = std::make_shared<ModelAsset>();
  asset->glb.resize(data.count);
  data.capacity = data.count;
  data.bytes = asset->glb.data();
  read = done(kDataCall, functions_.get_asset_data(handle.get(), &get_data, &data));
  if (!read) return read.error();
  asset->glb.resize(data.count);
  const AssetPropertiesGetInfo get_names;
  std::vector<AssetNodeProperties> nodes(properties.moving_node_count);
  AssetProperties names;
  names.count = uint32_t(nodes.size());
  names.nodes = nodes.data();
  read = done("xrGetRenderModelAssetPropertiesEXT",
              functions_.get_asset_properties(handle.get(), &get_names, &names));
  if (!read) return read.error();
  for (const AssetNodeProperties& node : nodes)
    asset->moving_nodes.emplace_back(node.name, strnlen(node.name, sizeof node.name));
  return std::shared_ptr<const ModelAsset>(std::move(asset));
}

Outcome<std::vector<HeldModel>> RenderModels::locate_all(XrSpace base, XrTime time,
                                                         const Pose& world_from_base) const {
  std::vector<HeldModel> held;
  for (const KnownModel& model : models_) {
    const auto base_from_model = locate(model.space.get(), base, time);
    if (!base_from_model) return base_from_model.error();
    if (!*base_from_model) continue;
    std::vector<ModelNodeState> states(model.asset->moving_nodes.size());
    ModelStateGetInfo get;
    get.display_time = time;
    ModelState state;
    state.count = uint32_t(states.size());
    state.nodes = states.data();
    const Done told =
        done("xrGetRenderModelStateEXT", functions_.get_state(model.handle.get(), &get, &state));
    if (!told) return told.error();
    HeldModel& shown = held.emplace_back();
    shown.asset = model.asset;
    shown.world_from_model = world_from_base * **base_from_model;
    for (const ModelNodeState& node : states)
      shown.nodes.push_back({pose_of(node.pose), node.visible == XR_TRUE});
  }
  return held;
}

/// A loss is reported to the session; after any other error models are left out.
Done RenderModels::refuse(const Problem& problem) {
  if (problem.trouble == Trouble::kSessionLost || problem.trouble == Trouble::kInstanceLost)
    return problem;
  refused_ = call_text(problem);
  models_.clear();
  functions_ = {};
  return Nothing{};
}

}  // namespace palpate::xr
