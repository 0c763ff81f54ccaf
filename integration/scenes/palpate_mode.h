/* palpate_mode.h: haptic modes of your own, in C99 or anything that can make a shared library.

   A mode turns data into something for the hand: a surface here, a line there, a push. Once per
   haptic frame it is asked: the material point under the proxy has these data; which primitives
   hold there? Time, moving transforms, motion and devices are none of its business. The library
   exports one function, pal_mode_kinds(); `palpate feel scene.json --modes ./libmymode.so` and
   PalSceneInfo's mode_libraries load it, and scenes may then name its kinds. docs/writing-a-mode.md
   says more; docs/examples/my_mode.c is a whole one.

   It is code that runs in every haptic frame, in the process that loads it. Lengths are m, forces
   N, in the volume's own space. */
#ifndef PALPATE_MODE_H
#define PALPATE_MODE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Of this header; what changes it makes libraries that were compiled before to be refused. */
#define PAL_MODE_VERSION 1u

/* What the scene says of a mode. Valid as long as the mode. */
typedef struct PalModeSpec {
  const char* name;
  double gain, range_m;
  double point_m[3];
  uint32_t is_two_sided, is_leaving;
  /* The scene's functions of the data's value: strength, N, and Coulomb's mu; and the largest
     strength that there is. */
  double (*strength_n)(const struct PalModeSpec* spec, double value);
  double (*friction)(const struct PalModeSpec* spec, double value);
  double highest_strength_n;
  const void* scene; /* palpate's own */
} PalModeSpec;

/* One haptic frame, as a mode sees it. Reading twice costs nothing. */
typedef struct PalModeSite {
  double proxy_m[3];
  double hand_m[3]; /* only where the kind wants it */
  double dt_s;
  /* Of the data at the proxy: what "scalar" and "vector" are, the scene chooses. */
  double (*scalar)(const struct PalModeSite* site);
  void (*scalar_gradient)(const struct PalModeSite* site, double per_m[3]);
  void (*vector)(const struct PalModeSite* site, double vector[3]);
  /* The proxy may not go behind a plane, on whose far side is `outward` (any length > 0). */
  void (*surface)(const struct PalModeSite* site, const double position_m[3],
                  const double outward[3], double strength_n, double friction);
  /* It is held on a line, at a point, or pushed. */
  void (*line)(const struct PalModeSite* site, const double position_m[3], const double tangent[3],
               double strength_n);
  void (*point)(const struct PalModeSite* site, const double position_m[3], double strength_n);
  void (*force)(const struct PalModeSite* site, const double tangent[3], double strength_n);
  const void* data; /* palpate's own */
  void* sink;
} PalModeSite;

typedef struct PalModeKind {
  const char* name; /* as scenes have it: "snap" */
  uint32_t wants_hand;
  /* Makes a mode of a scene. NULL: the scene's part can not be used, and `why` (a sentence, with
     its end at most `capacity` bytes) says why. */
  void* (*make)(const PalModeSpec* spec, char* why, size_t capacity);
  /* In every haptic frame: no allocation, no lock, no output. Others may use the mode meanwhile.
     These functions should not throw; a mode in C++ that does is left out, and that is said. */
  void (*place)(const void* mode, const PalModeSite* site);
  void (*destroy)(void* mode); /* NULL: there is nothing to free */
} PalModeKind;

/* What the library exports: sets *kinds to its kinds, and returns how many there are; 0 if
   `version`, palpate's PAL_MODE_VERSION, is not its own. */
uint32_t pal_mode_kinds(uint32_t version, const PalModeKind** kinds);

#ifdef __cplusplus
}
#endif

#endif /* PALPATE_MODE_H */
