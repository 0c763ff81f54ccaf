/* A haptic mode of your own, in C: the hand is pulled to an iso-surface and slides along it.

     cc -std=c99 -O2 -shared -fPIC my_mode.c $(pkg-config --cflags palpate) -lm -o libmy_mode.so
     palpate feel my_mode.json --modes ./libmy_mode.so

   In a scene, a mode of the kind "snap-c" has the iso-value as "gain" and the reach (m) as
   "range_m". */
#include <math.h>
#include <palpate_mode.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct Snap {
  double iso_value, reach_m, strength_n;
} Snap;

static void* make(const PalModeSpec* spec, char* why, size_t capacity) {
  if (!(spec->range_m > 0.0)) {
    snprintf(why, capacity, "it needs a range_m above 0");
    return NULL;
  }
  Snap* snap = malloc(sizeof *snap);
  if (!snap) {
    snprintf(why, capacity, "there is no memory for it");
    return NULL;
  }
  snap->iso_value = spec->gain;
  snap->reach_m = spec->range_m;
  snap->strength_n = spec->highest_strength_n;
  return snap;
}

static void place(const void* mode, const PalModeSite* site) {
  const Snap* snap = mode;
  double uphill[3], foot_m[3], downhill[3];
  site->scalar_gradient(site, uphill);
  const double slope = sqrt(uphill[0] * uphill[0] + uphill[1] * uphill[1] + uphill[2] * uphill[2]);
  if (!(slope > 0.0)) return; /* no gradient: the direction to the surface is not known */
  const double away_m = (site->scalar(site) - snap->iso_value) / slope;
  /* Falls linearly to 0 at the reach, so that the force has no step there. */
  const double strength_n = snap->strength_n * (1.0 - fabs(away_m) / snap->reach_m);
  for (int a = 0; a < 3; ++a) {
    foot_m[a] = site->proxy_m[a] - uphill[a] * (away_m / slope);
    downhill[a] = -uphill[a];
  }
  site->surface(site, foot_m, uphill, strength_n, 0.0);
  site->surface(site, foot_m, downhill, strength_n, 0.0);
}

uint32_t pal_mode_kinds(uint32_t version, const PalModeKind** kinds) {
  static const PalModeKind snap = {"snap-c", 0, make, place, free};
  *kinds = &snap;
  return version == PAL_MODE_VERSION ? 1 : 0;
}
