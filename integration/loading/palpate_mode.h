/* palpate_mode.h: haptic modes of your own, in C99 or anything that can make a shared library.

   A mode makes primitives of data: a surface, a line, a point, a force. palpate calls it in every
   haptic frame, once or several times, each time with the data at a material point under the proxy;
   the mode places the primitives that act there. palpate handles time, moving transforms, motion
   and devices. The library exports one function, pal_mode_kinds(). The option --modes and
   PalSceneInfo's mode_libraries load it; then scenes may name its kinds. docs/writing-a-mode.md has
   the details, docs/examples/my_mode.c is a complete example.

   The code runs in the process that loads it. Lengths are m, forces N, positions and directions in
   the volume's own space. */
#ifndef PALPATE_MODE_H
#define PALPATE_MODE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this header. A library that was compiled with another version is refused. */
#define PAL_MODE_VERSION 1u

/* A mode's part of the scene, given to make(). Valid as long as the mode. */
typedef struct PalModeSpec {
  const char* name;
  /* The keys "gain", "range_m", "point_m", "two_sided" and "leaving" of the scene file. What they
     mean is up to the kind. */
  double gain, range_m;
  double point_m[3];
  uint32_t is_two_sided, is_leaving;
  /* The scene's transfer functions of the data's value: strength, N, and Coulomb's mu; and the
     largest value of the strength. */
  double (*strength_n)(const struct PalModeSpec* spec, double value);
  double (*friction)(const struct PalModeSpec* spec, double value);
  double highest_strength_n;
  const void* scene; /* used by palpate */
} PalModeSpec;

/* The inputs and outputs of place() in one haptic frame. Valid during the call. Data are read at
   the first call of a function; later calls return the same result at no cost. */
typedef struct PalModeSite {
  double proxy_m[3];
  double hand_m[3]; /* the probe, if the kind has wants_hand; else proxy_m */
  double dt_s;      /* length of the haptic frame */
  /* The data at the proxy. Which property is "scalar" and which is "vector", the scene chooses. */
  double (*scalar)(const struct PalModeSite* site);
  void (*scalar_gradient)(const struct PalModeSite* site, double per_m[3]);
  void (*vector)(const struct PalModeSite* site, double vector[3]);
  /* Adds a plane: the proxy stays on the side to which `outward` points (any length above 0), with
     Coulomb friction. */
  void (*surface)(const struct PalModeSite* site, const double position_m[3],
                  const double outward[3], double strength_n, double friction);
  /* Adds a line or a point that pulls the proxy, or a force along `tangent`. */
  void (*line)(const struct PalModeSite* site, const double position_m[3], const double tangent[3],
               double strength_n);
  void (*point)(const struct PalModeSite* site, const double position_m[3], double strength_n);
  void (*force)(const struct PalModeSite* site, const double tangent[3], double strength_n);
  const void* data; /* used by palpate */
  void* sink;       /* used by palpate */
} PalModeSite;

typedef struct PalModeKind {
  const char* name; /* the word in scenes, for example "snap" */
  /* Not 0: place() reads hand_m, which costs palpate one more back-tracking in each call. */
  uint32_t wants_hand;
  /* Makes a mode from its part of the scene. NULL: this part can not be used; then `why` contains a
     sentence, of at most `capacity` bytes with the final zero. */
  void* (*make)(const PalModeSpec* spec, char* why, size_t capacity);
  /* Called in every haptic frame: it must not allocate, lock or print. Other threads may use the
     mode at the same time. These functions should not throw: after an exception palpate leaves the
     mode out and reports it. */
  void (*place)(const void* mode, const PalModeSite* site);
  void (*destroy)(void* mode); /* NULL if there is nothing to free */
} PalModeKind;

/* Exported by the library: sets *kinds to an array of its kinds, which must stay valid, and returns
   their number; 0 if `version` (palpate's PAL_MODE_VERSION) differs from the library's. */
uint32_t pal_mode_kinds(uint32_t version, const PalModeKind** kinds);

#ifdef __cplusplus
}
#endif

#endif /* PALPATE_MODE_H */
