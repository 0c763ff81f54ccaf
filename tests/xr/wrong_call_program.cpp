// One call that OpenXR forbids (a structure of the wrong type), which a validation layer must
// report. The control of core_validation_test.sh.

#include <openxr/openxr.h>

#include <cstring>

int main() {
  XrInstanceCreateInfo create{XR_TYPE_INSTANCE_CREATE_INFO};
  std::strcpy(create.applicationInfo.applicationName, "wrong");
  create.applicationInfo.apiVersion = XR_MAKE_VERSION(1, 0, 0);
  XrInstance instance = XR_NULL_HANDLE;
  if (xrCreateInstance(&create, &instance) != XR_SUCCESS) return 2;
  XrInstanceProperties properties{XR_TYPE_SYSTEM_PROPERTIES};
  xrGetInstanceProperties(instance, &properties);
  xrDestroyInstance(instance);
  return 0;
}
