/* The headers as a strict C compiler sees them: they compile, and their structures are as C++ has
 * them. */
#include "tests/toolkit/c_header.h"

#define SIZE(name) {#name, sizeof(name)},
const CStructure kCStructures[] = {C_STRUCTURES(SIZE){0, 0}};
