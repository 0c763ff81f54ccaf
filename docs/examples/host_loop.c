/* A program with its own haptic loop gets the force of a moving volume from palpate. C99; it needs
   only palpate.h.

   cc -std=c99 host_loop.c $(pkg-config --cflags --libs palpate) -lm -o host_loop
   ./host_loop                        the built-in beating heart
   ./host_loop frame_*.mha            frames of a sequence: its motion is estimated while it is felt
   ./host_loop scene.json --folder D  a scene
   --seconds N as the last option: run for N s instead of 8 s

   The "device" is a mass of 0.1 kg on a spring, which a simulated hand pulls towards the volume's
   middle. Once a millisecond the program passes its position to palpate, gets the force, and moves
   the mass. A real device would be read and written at the same place. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <palpate.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static int fail(const char* doing) {
  fprintf(stderr, "host_loop: %s: %s\n", doing, pal_last_error());
  return 1;
}

static void on_event(void* user, PalEventKind kind, const char* sentence) {
  (void)user;
  (void)kind;
  printf("palpate: %s\n", sentence);
  fflush(stdout);
}

/* The mass that the hand pulls. Metres, in the device's space: x right, y up, z towards the user.
 */
typedef struct Grip {
  double position_m[3], velocity_m_per_s[3];
} Grip;

static void move(Grip* grip, const double hand_m[3], const double force_n[3], double dt_s) {
  const double mass_kg = 0.1, stiffness_n_per_m = 300.0, damping_n_s_per_m = 8.0;
  for (int a = 0; a < 3; ++a) {
    const double pull_n = stiffness_n_per_m * (hand_m[a] - grip->position_m[a]) -
                          damping_n_s_per_m * grip->velocity_m_per_s[a];
    grip->velocity_m_per_s[a] += dt_s * (pull_n + force_n[a]) / mass_kg;
    grip->position_m[a] += dt_s * grip->velocity_m_per_s[a];
  }
}

static double length_of(const double v[3]) {
  return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

int main(int argc, char** argv) {
  /* The scene. */
  const char* built_in = "heart";
  int end_ms = 8000;
  if (argc > 2 && strcmp(argv[argc - 2], "--seconds") == 0) {
    end_ms = 1000 * atoi(argv[argc - 1]);
    argc -= 2;
  }
  PalSceneInfo scene_info = {.size = sizeof scene_info, .paths = &built_in, .path_count = 1};
  if (argc > 2 && strcmp(argv[argc - 2], "--folder") == 0) {
    scene_info.folder = argv[argc - 1];
    argc -= 2;
  }
  if (argc > 1) {
    scene_info.paths = (const char* const*)argv + 1;
    scene_info.path_count = (uint32_t)(argc - 1);
  }
  const PalContextInfo context_info = {.size = sizeof context_info, .version = PAL_VERSION};
  PalContext* context = NULL;
  if (pal_context_open(&context_info, &context) != PAL_OK) return fail("opening palpate");
  PalScene* scene = NULL;
  if (pal_scene_open(context, &scene_info, &scene) != PAL_OK) return fail("reading the scene");
  char plan[4096];
  if (pal_scene_text(scene, PAL_SCENE_TEXT_PLAN, plan, sizeof plan, NULL) == PAL_OK)
    printf("%s\n", plan);

  /* The session, with this program's own loop. */
  const PalDeviceInfo device = {.size = sizeof device,
                                .name = "example",
                                .max_force_n = 8.0,
                                .max_stiffness_n_per_m = 3000.0,
                                .workspace_radius_m = 0.1};
  const PalSessionInfo session_info = {.size = sizeof session_info,
                                       .flags = PAL_SESSION_HOST_TICKS,
                                       .host = &device,
                                       .preset = "fast",
                                       .on_event = on_event};
  PalSession* session = NULL;
  if (pal_session_open(scene, &session_info, &session) != PAL_OK)
    return fail("starting the session");

  Grip grip = {{0.0, 0.0, 0.09}, {0.0, 0.0, 0.0}};
  double most_n = 0.0, most_change_n = 0.0, last_n[3] = {0.0, 0.0, 0.0};
  int contact_ms = 0, ticks = 0;
  struct timespec next;
  clock_gettime(CLOCK_MONOTONIC, &next);
  for (; ticks < end_ms; ++ticks) {
    /* The hand moves inwards for two seconds, then stays where it is. */
    const double way = ticks < 2000 ? ticks / 2000.0 : 1.0;
    const double hand_m[3] = {0.0, 0.0, 0.09 * (1.0 - way)};
    PalTick tick = {{grip.position_m[0], grip.position_m[1], grip.position_m[2]}, 0, 0};
    tick.time_ns = (int64_t)next.tv_sec * 1000000000 + next.tv_nsec;
    double force_n[3];
    if (pal_haptics_tick(session, &tick, force_n) != PAL_OK) return fail("asking for a force");
    const double change_n[3] = {force_n[0] - last_n[0], force_n[1] - last_n[1],
                                force_n[2] - last_n[2]};
    most_change_n = fmax(most_change_n, length_of(change_n));
    memcpy(last_n, force_n, sizeof last_n);
    most_n = fmax(most_n, length_of(force_n));
    move(&grip, hand_m, force_n, 1e-3);
    /* A program with a picture asks this on the picture's thread. A force alone is no contact:
     * while it comes up, it damps a free hand. */
    PalState state = {.size = sizeof state};
    if (ticks % 20 == 19 && pal_session_state(session, &state) == PAL_OK)
      contact_ms += state.in_contact ? 20 : 0;
    if (ticks % 1000 == 999) {
      printf("%d s: %.2f N, motion %u of %u steps%s%s\n", ticks / 1000 + 1, length_of(force_n),
             state.steps_known, state.steps, state.cause[0] ? ", " : "", state.cause);
      fflush(stdout);
    }
    next.tv_nsec += 1000000;
    if (next.tv_nsec >= 1000000000) {
      next.tv_nsec -= 1000000000;
      ++next.tv_sec;
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
  }

  /* The end: the force is ramped to zero while the loop continues. */
  pal_session_stop(session);
  for (int k = 0; k < 1000 && !pal_session_at_rest(session); ++k, ++ticks) {
    PalTick tick = {{grip.position_m[0], grip.position_m[1], grip.position_m[2]}, 0, 0};
    tick.time_ns = (int64_t)next.tv_sec * 1000000000 + next.tv_nsec + (int64_t)k * 1000000;
    double force_n[3];
    if (pal_haptics_tick(session, &tick, force_n) != PAL_OK) return fail("letting the force down");
    memcpy(last_n, force_n, sizeof last_n);
  }
  printf(
      "felt %d ms of %d, at most %.2f N, at most %.3f N more from one millisecond to the next; "
      "%.2f N at the end\n",
      contact_ms, ticks, most_n, most_change_n, length_of(last_n));
  pal_session_close(&session);
  pal_scene_close(&scene);
  pal_context_close(&context);
  return 0;
}
