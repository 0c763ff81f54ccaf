// A host's picture that volumes are drawn over. Needs view, backdrop, colour_out, depth_out, and kBackdrop, whose bits are
// 1: there is one; 2: red and blue are swapped in it, and in the output; 4: its depths are 24-bit integers, not floats;
// 8: it has depths.
const float kFar = 1e30;

// The depth t of the backdrop; back_word: the same in the host's encoding.
float backdrop_depth(ivec2 size, uint out_index, out uint back_word) {
  back_word = 0u;
  float back_at = kFar;
  if ((kBackdrop & 8) != 0) {
    back_word = backdrop[uint(view.counts.x * size.x * size.y) + out_index];
    const float d = (kBackdrop & 4) != 0 ? float(back_word & 0xffffffu) / 16777215.0 : uintBitsToFloat(back_word);
    const float inverse = view.backdrop.x + view.backdrop.y * d;
    if (inverse > 1e-9) back_at = 1.0 / inverse;
  }
  return back_at;
}

// Writes a pixel of which this light reaches the eye, over the backdrop. depth: near / t; 0 where no volume takes half of
// the light, there the backdrop's depth stays.
void write_over(uint out_index, vec3 colour, float through, float depth, uint back_word) {
  // Where no light is absorbed the host's bytes stay unchanged.
  const vec4 back = unpackUnorm4x8(backdrop[out_index]);
  const bool swapped = (kBackdrop & 2) != 0;
  const vec3 over = encoded(colour + through * decoded(swapped ? back.bgr : back.rgb));
  const vec4 mixed = vec4(swapped ? over.bgr : over, mix(1.0, back.a, through));
  colour_out[out_index] = through == 1.0 ? backdrop[out_index] : packUnorm4x8(mixed);
  // In the backdrop's encoding.
  const float d = clamp((depth / view.background.w - view.backdrop.x) / view.backdrop.y, 0.0, 1.0);
  const uint word = (kBackdrop & 4) != 0 ? uint(d * 16777215.0 + 0.5) : floatBitsToUint(d);
  depth_out[out_index] = depth > 0.0 ? word : back_word;
}
