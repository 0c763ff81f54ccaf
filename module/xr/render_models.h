#pragma once

#include <span>
#include <string>
#include <vector>

#include "module/xr/held_model.h"
#include "module/xr/session.h"

namespace palpate::xr {

/// The shapes of the controllers (XR_EXT_interaction_render_model), where the runtime has them.
/// Without the extension no call is made. Move-only.
class RenderModels {
 public:
  explicit RenderModels(const Instance& instance) : functions_(instance.models) {}

  /// What is held may be something else now: it is asked for again.
  void changed() { known_ = false; }

  /// The models that have a place at `time`, after the actions were read. Asks for new ones first,
  /// which may take milliseconds: their bytes are copied. Fails only where the session is lost; a
  /// runtime that refuses is not asked again in this session.
  Outcome<std::vector<HeldModel>> read(const OpenXrSession& session, XrSpace base, XrTime time,
                                       const Pose& world_from_base);

  /// Whether there are models to be asked for.
  bool works() const { return bool(functions_); }
  /// The call that was refused, "xrCreateRenderModelEXT returned -2"; empty: none.
  const std::string& refused() const { return refused_; }

 private:
  struct KnownModel {
    ModelId id = 0;
    ExtensionHandle<ModelHandle> handle;
    XrHandle<XrSpace, xrDestroySpace> space;
    ModelUuid cache_id{};
    std::shared_ptr<const ModelAsset> asset;
  };
  Done ask(const OpenXrSession& session);
  Outcome<KnownModel> make(const OpenXrSession& session, ModelId id) const;
  Outcome<std::shared_ptr<const ModelAsset>> asset_of(const OpenXrSession& session,
                                                      const ModelProperties& properties) const;
  Outcome<std::vector<HeldModel>> locate_all(XrSpace base, XrTime time,
                                             const Pose& world_from_base) const;
  Done refuse(const Problem& problem);

  ModelFunctions functions_;
  std::vector<KnownModel> models_;
  bool known_ = false;
  std::string refused_;
};

}  // namespace palpate::xr
