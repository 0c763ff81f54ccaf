#pragma once

#include <openxr/openxr.h>

#include <utility>

#include "module/xr/pose.h"
#include "module/xr/problem.h"

/// What the files of this folder share around OpenXR calls; not for other folders.
namespace palpate::xr {

/// The trouble and its sentence for a call that returned an error.
Problem problem_of(const char* call, XrResult result);

/// Done, or the problem; success codes other than XR_SUCCESS are done too.
inline Done done(const char* call, XrResult result) {
  if (XR_FAILED(result)) return problem_of(call, result);
  return Nothing{};
}

/// Owns an OpenXR handle. Destroying is allowed after every loss. Move-only.
template <class T, XrResult(XRAPI_PTR* destroy)(T)>
class XrHandle {
 public:
  XrHandle() = default;
  explicit XrHandle(T handle) : handle_(handle) {}
  XrHandle(XrHandle&& other) noexcept : handle_(std::exchange(other.handle_, XR_NULL_HANDLE)) {}
  XrHandle& operator=(XrHandle&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~XrHandle() {
    if (handle_ != XR_NULL_HANDLE) destroy(handle_);
  }
  T get() const { return handle_; }
  T* out() { return &handle_; }
  explicit operator bool() const { return handle_ != XR_NULL_HANDLE; }

 private:
  T handle_ = XR_NULL_HANDLE;
};

/// The same for handles that are destroyed by a function that the runtime gives. Move-only.
template <class T>
class ExtensionHandle {
 public:
  using Destroy = XrResult(XRAPI_PTR*)(T);
  ExtensionHandle() = default;
  explicit ExtensionHandle(Destroy destroy) : destroy_(destroy) {}
  ExtensionHandle(ExtensionHandle&& other) noexcept
      : handle_(std::exchange(other.handle_, XR_NULL_HANDLE)), destroy_(other.destroy_) {}
  ExtensionHandle& operator=(ExtensionHandle&& other) noexcept {
    std::swap(handle_, other.handle_);
    std::swap(destroy_, other.destroy_);
    return *this;
  }
  ~ExtensionHandle() {
    if (handle_ != XR_NULL_HANDLE) destroy_(handle_);
  }
  T get() const { return handle_; }
  T* out() { return &handle_; }
  explicit operator bool() const { return handle_ != XR_NULL_HANDLE; }

 private:
  T handle_ = XR_NULL_HANDLE;
  Destroy destroy_ = nullptr;
};

inline Pose pose_of(const XrPosef& pose) {
  const glm::dquat q(pose.orientation.w, pose.orientation.x, pose.orientation.y,
                     pose.orientation.z);
  return {glm::dvec3(pose.position.x, pose.position.y, pose.position.z), glm::normalize(q)};
}

inline XrPosef xr_pose_of(const Pose& pose) {
  const glm::quat q(glm::normalize(pose.rotation));
  const glm::vec3 p(pose.position_m);
  return {{q.x, q.y, q.z, q.w}, {p.x, p.y, p.z}};
}

inline XrPosef identity_pose() {
  return {{0, 0, 0, 1}, {0, 0, 0}};
}

}  // namespace palpate::xr
