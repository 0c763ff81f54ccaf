#include "module/xr/visibility.h"

namespace palpate::xr {

Outcome<HiddenMesh> hidden_mesh(const Instance& instance, const OpenXrSession& session,
                                uint32_t view) {
  if (!instance.get_visibility_mask) return HiddenMesh{};
  const auto ask = [&](XrVisibilityMaskKHR& mask) {
    return done(
        "xrGetVisibilityMaskKHR",
        instance.get_visibility_mask(session.handle(), session.view_type(), view,
                                     XR_VISIBILITY_MASK_TYPE_HIDDEN_TRIANGLE_MESH_KHR, &mask));
  };
  XrVisibilityMaskKHR mask{XR_TYPE_VISIBILITY_MASK_KHR};
  Done asked = ask(mask);
  if (!asked) return asked.error();
  std::vector<XrVector2f> vertices(mask.vertexCountOutput);
  HiddenMesh mesh;
  mesh.triangles.resize(mask.indexCountOutput);
  if (vertices.empty() || mesh.triangles.empty()) return HiddenMesh{};
  mask.vertexCapacityInput = mask.vertexCountOutput;
  mask.vertices = vertices.data();
  mask.indexCapacityInput = mask.indexCountOutput;
  mask.indices = mesh.triangles.data();
  asked = ask(mask);
  if (!asked) return asked.error();
  for (const XrVector2f& vertex : vertices) mesh.vertices.emplace_back(vertex.x, vertex.y);
  // With an index out of range the GPU would read outside the buffer.
  for (const uint32_t index : mesh.triangles)
    if (index >= mesh.vertices.size()) return HiddenMesh{};
  mesh.triangles.resize(mesh.triangles.size() / 3 * 3);
  return mesh;
}

}  // namespace palpate::xr
