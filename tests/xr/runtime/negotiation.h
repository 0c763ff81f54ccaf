#pragma once

#include <openxr/openxr.h>

#include <cstddef>

/// The negotiation between the OpenXR loader and a runtime: interface version 1 of the loader.
/// Debian's headers do not contain these structures, so they are declared here.
extern "C" {

struct LoaderInfo {
  uint32_t struct_type;  ///< 1
  uint32_t struct_version;
  size_t struct_size;
  uint32_t min_interface_version, max_interface_version;
  XrVersion min_api_version, max_api_version;
};

struct RuntimeRequest {
  uint32_t struct_type;  ///< 3
  uint32_t struct_version;
  size_t struct_size;
  uint32_t runtime_interface_version;
  XrVersion runtime_api_version;
  PFN_xrGetInstanceProcAddr get_instance_proc_addr;
};
static_assert(sizeof(LoaderInfo) == 40 && sizeof(RuntimeRequest) == 40);

__attribute__((visibility("default"))) XrResult xrNegotiateLoaderRuntimeInterface(
    const LoaderInfo* loader, RuntimeRequest* request);
}
