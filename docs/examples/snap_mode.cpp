// The mode of snap_mode.h as a library, for `palpate feel scene.json --modes ./libsnap_mode.so`:
//   g++ -std=c++20 -O2 -shared -fPIC -I PALPATE docs/examples/snap_mode.cpp -o libsnap_mode.so
// PALPATE is palpate's source tree.
#include "docs/examples/snap_mode.h"

PALPATE_MODES(add_snap)
