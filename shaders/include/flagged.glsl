// Whether any cell within 1 of a cell is flagged. Border: clamped; `last` is the field's last cell.
bool touches_flagged(sampler3D flags, ivec3 cell, ivec3 last) {
  float flagged = 0.0;
  for (int k = 0; k < 27; ++k) {
    const ivec3 at = cell + ivec3(k % 3, k / 3 % 3, k / 9) - 1;
    flagged = max(flagged, texelFetch(flags, clamp(at, ivec3(0), last), 0).r);
  }
  return flagged > 0.0;
}
