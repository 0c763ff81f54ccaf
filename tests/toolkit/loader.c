/* Loads the library, feels a scene with it and lets it go, twice; 0 if all went well and it is gone
   after each time. With "device" as the second argument motion is estimated and a picture drawn,
   too; 77 if there is no Vulkan device. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>

#include "integration/toolkit/palpate.h"

/* The library's functions, as a program finds them that is not linked with it. */
#define FUNCTIONS(X)                                                                  \
  X(pal_last_error)                                                                   \
  X(pal_context_open) X(pal_context_close) X(pal_scene_open) X(pal_scene_close)       \
      X(pal_session_open) X(pal_session_close) X(pal_haptics_tick) X(pal_view_open)   \
          X(pal_view_render) X(pal_view_wait) X(pal_view_close) X(pal_estimator_open) \
              X(pal_estimator_push) X(pal_estimator_finish) X(pal_estimator_close)    \
                  X(pal_motion_close)
#define DECLARE(name) static __typeof__(&name) name##_;
FUNCTIONS(DECLARE)

static int fail(const char* doing) {
  fprintf(stderr, "loader: %s: %s\n", doing, pal_last_error_ ? pal_last_error_() : dlerror());
  return 1;
}

static void* tick(void* session) {
  double force_n[3];
  PalTick at;
  memset(&at, 0, sizeof at);
  for (int k = 0; k < 200; ++k) {
    at.position_m[2] = 0.05 - 1e-4 * k;
    at.time_ns = 1000000000 + 1000000 * (int64_t)k;
    if (pal_haptics_tick_((PalSession*)session, &at, force_n) != PAL_OK) return session;
  }
  pal_haptics_tick_(NULL, &at, force_n); /* this thread has a sentence */
  return NULL;
}

static int estimate(PalContext* context) {
  static float frames[2][16 * 16 * 16];
  for (int n = 0; n < 16 * 16 * 16; ++n) {
    frames[0][n] = (float)(n % 16 * 10 + n / 256);
    frames[1][n] = frames[0][n] + 5.0F;
  }
  PalEstimatorInfo info;
  memset(&info, 0, sizeof info);
  info.size = sizeof info;
  info.preset = "fast";
  for (int a = 0; a < 3; ++a) {
    info.grid.size[a] = 16;
    info.grid.spacing_mm[a] = 1.0;
  }
  PalEstimator* estimator = NULL;
  PalMotion* motion = NULL;
  if (pal_estimator_open_(context, &info, &estimator) != PAL_OK) return fail("an estimator");
  for (int k = 0; k < 2; ++k)
    if (pal_estimator_push_(estimator, PAL_FLOAT32, frames[k], -1.0) != PAL_OK)
      return fail("a frame");
  if (pal_estimator_finish_(estimator, &motion) != PAL_OK) return fail("motion");
  pal_motion_close_(&motion);
  pal_estimator_close_(&estimator);
  return 0;
}

static int draw(PalSession* session) {
  PalViewInfo info;
  memset(&info, 0, sizeof info);
  info.size = sizeof info;
  info.width = info.height = 32;
  info.eye_count = 1;
  const PalEye eye = {{0.0, 0.0, 0.3}, {0.0, 0.0, 0.0, 1.0}, -0.3, 0.3, -0.3, 0.3};
  PalView* view = NULL;
  if (pal_view_open_(session, &info, &view) != PAL_OK) return fail("a view");
  if (pal_view_render_(view, &eye, 1, 32, 32, 0.0, NULL) != PAL_OK) return fail("a picture");
  pal_view_close_(&view);
  return 0;
}

static int use(int device) {
  PalContextInfo of_context;
  memset(&of_context, 0, sizeof of_context);
  of_context.size = sizeof of_context;
  of_context.version = PAL_VERSION;
  of_context.flags = device ? 0 : PAL_CONTEXT_NO_GPU;
  PalContext* context = NULL;
  const PalResult opened = pal_context_open_(&of_context, &context);
  if (opened == PAL_NO_DEVICE) return 77;
  if (opened != PAL_OK || !context) return fail("a context");

  const char* path = "molecule"; /* it takes no time to make */
  PalSceneInfo of_scene;
  memset(&of_scene, 0, sizeof of_scene);
  of_scene.size = sizeof of_scene;
  of_scene.paths = &path;
  of_scene.path_count = 1;
  PalScene* scene = NULL;
  if (pal_scene_open_(context, &of_scene, &scene) != PAL_OK) return fail("a scene");

  PalDeviceInfo host;
  memset(&host, 0, sizeof host);
  host.size = sizeof host;
  host.max_force_n = 10.0;
  host.workspace_radius_m = 1.0;
  PalSessionInfo of_session;
  memset(&of_session, 0, sizeof of_session);
  of_session.size = sizeof of_session;
  of_session.flags = PAL_SESSION_HOST_TICKS;
  of_session.host = &host;
  PalSession* session = NULL;
  if (pal_session_open_(scene, &of_session, &session) != PAL_OK) return fail("a session");
  pthread_t thread;
  void* failed = NULL;
  if (pthread_create(&thread, NULL, &tick, session) != 0 || pthread_join(thread, &failed) != 0 ||
      failed)
    return fail("a tick");
  if (device && (estimate(context) != 0 || draw(session) != 0)) return 1;
  if (pal_session_close_(&session) != PAL_OK || pal_scene_close_(&scene) != PAL_OK ||
      pal_context_close_(&context) != PAL_OK || context)
    return fail("closing");
  return 0;
}

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  for (int round = 0; round < 2; ++round) {
    void* library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "loader: %s\n", dlerror()), 1;
#define FIND(name) \
  if (!(*(void**)& name##_ = dlsym(library, #name))) return fail("finding " #name);
    FUNCTIONS(FIND)
    const int used = use(argc > 2 && strcmp(argv[2], "device") == 0);
    if (used != 0) return used;
    if (dlclose(library) != 0)
      return fprintf(stderr, "loader: it is not let go: %s\n", dlerror()), 1;
    if (dlopen(argv[1], RTLD_NOW | RTLD_NOLOAD))
      return fprintf(stderr, "loader: it stays in memory\n"), 1;
  }
  return 0;
}
