#include "module/xr/session.h"

namespace palpate::xr {

Outcome<OpenXrSession> OpenXrSession::make(const Instance& instance, const System& system,
                                           std::shared_ptr<vulkan::Context> context,
                                           std::optional<uint32_t> overlay) {
  XrGraphicsBindingVulkan2KHR binding{XR_TYPE_GRAPHICS_BINDING_VULKAN2_KHR};
  binding.instance = context->instance();
  binding.physicalDevice = context->physical_device();
  binding.device = context->device();
  binding.queueFamilyIndex = context->queue_family();
  binding.queueIndex = 0;
  XrSessionCreateInfo create{XR_TYPE_SESSION_CREATE_INFO};
  XrSessionCreateInfoOverlayEXTX above{XR_TYPE_SESSION_CREATE_INFO_OVERLAY_EXTX};
  above.next = &binding;
  above.sessionLayersPlacement = overlay.value_or(0);
  create.next = overlay ? static_cast<const void*>(&above) : &binding;
  create.systemId = system.id;

  OpenXrSession made;
  made.view_type_ = system.view_type;
  made.context_ = std::move(context);
  // The runtime may use the queue in here.
  const auto queue = made.context_->hold_queue();
  const Done created =
      done("xrCreateSession", xrCreateSession(instance.handle(), &create, made.handle_.out()));
  if (!created) return created.error();
  return made;
}

OpenXrSession::~OpenXrSession() {
  if (!handle_) return;
  const auto queue = context_->hold_queue();
  handle_ = {};
}

Outcome<Duty> OpenXrSession::announced(XrSessionState state) {
  const Duty duty = life_.announced(SessionState(state));
  if (duty == Duty::kBegin) {
    XrSessionBeginInfo begin{XR_TYPE_SESSION_BEGIN_INFO};
    begin.primaryViewConfigurationType = view_type_;
    const Done begun = done("xrBeginSession", xrBeginSession(handle(), &begin));
    if (!begun) return begun.error();
    life_.begun();
    return Duty::kNone;
  }
  if (duty == Duty::kEnd) {
    life_.ended();
    const Done ended = done("xrEndSession", xrEndSession(handle()));
    if (!ended) return ended.error();
    return Duty::kNone;
  }
  return duty;
}

Done OpenXrSession::request_exit() {
  if (!life_.running()) return Nothing{};
  return done("xrRequestExitSession", xrRequestExitSession(handle()));
}

}  // namespace palpate::xr
