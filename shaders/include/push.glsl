// Push constants, copied before the first branch: main() begins with `push = push_constants;`. A CPU driver (llvmpipe)
// reads a push constant behind a branch lane by lane, eight loads instead of one; a GPU keeps them in scalar registers
// in both cases.
#define PUSH_CONSTANTS(Type)                                    \
  layout(push_constant) uniform Push { Type push_constants; };  \
  Type push
