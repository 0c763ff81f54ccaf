// What a coarser level left unexplained in a cell when it ended: (r^2 - W (w - q)) / (2 q + flat w), at least 0: r^2
// beyond noise, relative to twice the variance of the normalised frames. left: (-, r^2, w, q) from
// normal_equations.comp. noise: W. flat_too: flat.
float left_over(vec4 left, float noise, float flat_too) {
  return max(left.y - noise * max(left.z - left.w, 0.0), 0.0) / (2.0 * left.w + flat_too * left.z + 1e-4);
}
