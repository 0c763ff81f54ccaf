/* palpate_unity.h: what the plugin for Unity's rendering gives to scripts. C99.

   Unity loads libpalpate_unity.so before it makes its Vulkan device ("Load on startup" in the
   plugin's import settings). The plugin then switches on what palpate needs of the device, and
   guards its queue with a lock that Unity's own submissions take, too. palpate_unity_device() gives
   that device for PalContextInfo.vulkan; palpate_unity_event() draws into a camera's images. */
#ifndef PALPATE_UNITY_H
#define PALPATE_UNITY_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A picture that Unity's render thread shall draw. A script fills it in, passes its address with
   palpate_unity_event() to CommandBuffer.IssuePluginEventAndData(), and leaves it and the view
   alone until is_done is 1. */
typedef struct PalUnityPicture {
  uint32_t size;      /* sizeof(PalUnityPicture) */
  uint32_t eye_count; /* 1 or 2 */
  PalView* view;
  PalEye eyes[2];
  double ahead_s;
  /* Of a render texture per eye: RenderBuffer.GetNativeRenderBufferPtr() of its colour and of its
     depth (NULL: all that Unity drew is behind); both eyes may name the layers of one. Formats as
     in PalImages, one sample per pixel. */
  void* colour[2];
  void* depth[2];
  uint32_t colour_layer[2], depth_layer[2];
  /* 1 / z where the depth is 0, and where it is 1; 1/m. Unity's depth is reversed: 1 / far and
     1 / near. */
  double inverse_depth_0, inverse_depth_1;
  uint32_t writes_depth;
  /* Written by the plugin. */
  uint32_t is_done; /* 1: drawn, or failed */
  PalResult result;
  uint32_t width, height;
  char sentence[248]; /* why it failed, or "" */
  PalImages images;
} PalUnityPicture;

/* Unity's device, for PalContextInfo.vulkan, valid until Unity's device is shut down.
   PAL_NO_DEVICE, with palpate_unity_error(), if Unity does not draw with Vulkan, or if the plugin
   was loaded too late. Main thread. */
PAL_API PalResult palpate_unity_device(PalVulkan* vulkan);
/* Why the last call of palpate_unity_device() failed, or ""; static. */
PAL_API const char* palpate_unity_error(void);
/* The function for CommandBuffer.IssuePluginEventAndData(), and the number of its event. */
PAL_API void* palpate_unity_event(void);
PAL_API int palpate_unity_event_id(void);

#ifdef __cplusplus
}
#endif

#endif /* PALPATE_UNITY_H */
