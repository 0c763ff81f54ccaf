/* A host in C99: replays a recording of a scene with a known motion, and draws the scene as `palpate view` does.
   usage: replay_host FIELDS RECORDING PICTURE.ppm SIZE FRAME...
   Prints a JSON object: the replay, and the camera for hosts that are told it. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <palpate.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static int fail(const char* doing) {
  fprintf(stderr, "replay_host: %s: %s\n", doing, pal_last_error());
  return 1;
}

/* The eye of `palpate view` before the corners of a box in the world, for a square picture; axes: its right, up and back. */
static PalEye eye_before(const double corners_m[8][3], double middle_m[3]) {
  const double away[3] = {0.42, 0.30, 1.0}, tan_up = tan(0.5 * 0.55), filled = 0.93;
  const double length = sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2]);
  double axes[3][3], distance_m = 1e-6;
  for (int a = 0; a < 3; ++a) {
    double low_m = 1e9, high_m = -1e9;
    for (int corner = 0; corner < 8; ++corner) low_m = fmin(low_m, corners_m[corner][a]), high_m = fmax(high_m, corners_m[corner][a]);
    axes[2][a] = away[a] / length;
    middle_m[a] = 0.5 * (low_m + high_m);
  }
  const double* back = axes[2];
  const double flat = hypot(back[0], back[2]);
  axes[0][0] = back[2] / flat, axes[0][1] = 0.0, axes[0][2] = -back[0] / flat;
  axes[1][0] = back[1] * axes[0][2], axes[1][1] = back[2] * axes[0][0] - back[0] * axes[0][2], axes[1][2] = -back[1] * axes[0][0];
  for (int corner = 0; corner < 8; ++corner) {
    double along[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; ++k)
      for (int a = 0; a < 3; ++a) along[k] += axes[k][a] * (corners_m[corner][a] - middle_m[a]);
    distance_m = fmax(distance_m, fmax(fabs(along[0]), fabs(along[1])) / (filled * tan_up) + along[2]);
  }
  PalEye eye = {.tan_left = -tan_up, .tan_right = tan_up, .tan_down = -tan_up, .tan_up = tan_up};
  for (int a = 0; a < 3; ++a) eye.position_m[a] = middle_m[a] + distance_m * back[a];
  /* Its rotation as a quaternion; it is far from half a turn. */
  const double w = 0.5 * sqrt(1.0 + axes[0][0] + axes[1][1] + axes[2][2]);
  eye.orientation[0] = (axes[1][2] - axes[2][1]) / (4.0 * w);
  eye.orientation[1] = (axes[2][0] - axes[0][2]) / (4.0 * w);
  eye.orientation[2] = (axes[0][1] - axes[1][0]) / (4.0 * w);
  eye.orientation[3] = w;
  return eye;
}

/* The corners of the scene's first volume in the world. */
static PalResult corners_of(const PalScene* scene, double corners_m[8][3]) {
  PalVolume volume = {.size = sizeof volume};
  const PalResult result = pal_scene_volume(scene, 0, &volume);
  for (int corner = 0; corner < 8; ++corner)
    for (int row = 0; row < 3; ++row) {
      const double* pose = volume.world_from_volume + 4 * row;
      double at = pose[3];
      for (int a = 0; a < 3; ++a) {
        double place = volume.corner_m[a];
        for (int edge = 0; edge < 3; ++edge) place += (corner >> edge & 1) * volume.edges_m[3 * edge + a];
        at += pose[a] * place;
      }
      corners_m[corner][row] = at;
    }
  return result;
}

/* Draws the first frame. */
static int draw(PalScene* scene, const PalEye* eye, const char* file, uint32_t size) {
  const PalDeviceInfo device = {.size = sizeof device, .name = "test", .max_force_n = 8.0, .max_stiffness_n_per_m = 3000.0, .workspace_radius_m = 0.2};
  const PalSessionInfo session_info = {.size = sizeof session_info, .flags = PAL_SESSION_HOST_TICKS, .host = &device};
  const PalViewInfo view_info = {.size = sizeof view_info, .flags = PAL_VIEW_NO_HAND, .width = size, .height = size, .eye_count = 1};
  const PalTick tick = {{0.0, 0.0, 0.09}, 1, 0};
  PalSession* session = NULL;
  PalView* view = NULL;
  double force_n[3];
  if (pal_session_open(scene, &session_info, &session) != PAL_OK) return fail("opening a session");
  if (pal_session_play(session, 0) != PAL_OK || pal_session_scrub(session, 0.0) != PAL_OK) return fail("pausing");
  if (pal_haptics_tick(session, &tick, force_n) != PAL_OK) return fail("ticking");
  if (pal_view_open(session, &view_info, &view) != PAL_OK) return fail("opening a view");
  uint32_t* pixels = malloc(sizeof *pixels * size * size);
  FILE* out = fopen(file, "wb");
  if (!pixels || !out) return fail("making a file");
  if (pal_view_render(view, eye, 1, size, size, 0.0, NULL) != PAL_OK || pal_view_read(view, 0, pixels, NULL) != PAL_OK) return fail("drawing");
  fprintf(out, "P6\n%u %u\n255\n", size, size);
  for (uint32_t k = 0; k < size * size; ++k)
    for (int channel = 0; channel < 3; ++channel) fputc(pixels[k] >> (8 * channel) & 255, out);
  const int written = fclose(out) == 0;
  free(pixels);
  pal_view_close(&view);
  pal_session_close(&session);
  return written ? 0 : fail("writing the picture");
}

int main(int argc, char** argv) {
  if (argc < 6) return 2;
  const PalContextInfo context_info = {.size = sizeof context_info, .version = PAL_VERSION};
  const PalSceneInfo scene_info = {
      .size = sizeof scene_info, .paths = (const char* const*)argv + 5, .path_count = (uint32_t)(argc - 5), .fields = argv[1]};
  PalContext* context = NULL;
  PalScene* scene = NULL;
  if (pal_context_open(&context_info, &context) != PAL_OK) return fail("opening palpate");
  if (pal_scene_open(context, &scene_info, &scene) != PAL_OK) return fail("reading the scene");
  PalReplay replay = {.size = sizeof replay};
  if (pal_scene_replay(scene, argv[2], NULL, &replay) != PAL_OK) return fail("replaying");
  double corners_m[8][3], middle_m[3];
  if (corners_of(scene, corners_m) != PAL_OK) return fail("asking for the volume");
  const PalEye eye = eye_before(corners_m, middle_m);
  if (draw(scene, &eye, argv[3], (uint32_t)atoi(argv[4])) != 0) return 1;
  printf("{\"ticks\": %llu, \"different\": %llu, \"eye_m\": [%.17g, %.17g, %.17g], \"turn\": [%.17g, %.17g, %.17g, %.17g], "
         "\"middle_m\": [%.17g, %.17g, %.17g]}\n",
         (unsigned long long)replay.ticks, (unsigned long long)replay.different, eye.position_m[0], eye.position_m[1], eye.position_m[2],
         eye.orientation[0], eye.orientation[1], eye.orientation[2], eye.orientation[3], middle_m[0], middle_m[1], middle_m[2]);
  pal_scene_close(&scene);
  pal_context_close(&context);
  return 0;
}
