#pragma once

#include <memory>
#include <optional>

#include "compute/vulkan/context.h"
#include "module/xr/lifecycle.h"
#include "module/xr/system.h"

namespace palpate::xr {

/// Fourth in the life cycle: the session, and the calls that change its state. Move-only; what was
/// made from it must be gone before it.
class OpenXrSession {
 public:
  /// overlay: its place among the overlays above another program; none: not one of them.
  static Outcome<OpenXrSession> make(const Instance& instance, const System& system,
                                     std::shared_ptr<vulkan::Context> context,
                                     std::optional<uint32_t> overlay = std::nullopt);
  ~OpenXrSession();
  OpenXrSession(OpenXrSession&&) = default;
  OpenXrSession& operator=(OpenXrSession&&) = delete;

  /// Does what the announcement asks for (xrBeginSession, xrEndSession) and returns what is left to
  /// do for the owner: kDropLost, kDropEnded or kNone.
  Outcome<Duty> announced(XrSessionState state);
  /// Asks the runtime to let the session end; nothing to ask while it does not run.
  Done request_exit();

  XrSession handle() const { return handle_.get(); }
  const Lifecycle& life() const { return life_; }
  XrViewConfigurationType view_type() const { return view_type_; }
  vulkan::Context& context() const { return *context_; }

 private:
  OpenXrSession() = default;
  std::shared_ptr<vulkan::Context> context_;
  XrHandle<XrSession, xrDestroySession> handle_;
  XrViewConfigurationType view_type_{};
  Lifecycle life_;
};

}  // namespace palpate::xr
