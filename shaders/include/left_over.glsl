// What a coarser level left unexplained of a cell when it ended: r^2 beyond what noise leaves, W where it is flat, over
// twice the variance of the normalised frames, with `flat` against small ones. left: . r^2 w q, from normal_equations.
float left_over(vec4 left, float noise, float flat_too) {
  return max(left.y - noise * max(left.z - left.w, 0.0), 0.0) / (2.0 * left.w + flat_too * left.z + 1e-4);
}
