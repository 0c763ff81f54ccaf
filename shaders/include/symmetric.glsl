// A symmetric 3 x 3 matrix.
struct Symmetric { float xx, yy, zz, xy, xz, yz; };

// (a + damping I)^-1 b by cofactors; the damping makes the matrix positive definite.
vec3 solved(Symmetric a, float damping, vec3 b) {
  const float xx = a.xx + damping, yy = a.yy + damping, zz = a.zz + damping;
  const float cxx = yy * zz - a.yz * a.yz;
  const float cxy = a.xz * a.yz - a.xy * zz;
  const float cxz = a.xy * a.yz - a.xz * yy;
  const float determinant = xx * cxx + a.xy * cxy + a.xz * cxz;
  return vec3(cxx * b.x + cxy * b.y + cxz * b.z,
              cxy * b.x + (xx * zz - a.xz * a.xz) * b.y + (a.xy * a.xz - xx * a.yz) * b.z,
              cxz * b.x + (a.xy * a.xz - xx * a.yz) * b.y + (xx * yy - a.xy * a.xy) * b.z) / determinant;
}

vec3 times(Symmetric a, vec3 v) {
  return vec3(a.xx * v.x + a.xy * v.y + a.xz * v.z, a.xy * v.x + a.yy * v.y + a.yz * v.z,
              a.xz * v.x + a.yz * v.y + a.zz * v.z);
}

// The matrix of the normal equations, from the images that normal_equations.comp writes.
Symmetric matrix_of(vec4 e0, vec4 e1, vec4 e2) { return Symmetric(e0.w, e1.z, e2.x, e1.x, e1.y, e1.w); }

vec3 shortened(vec3 d, float limit) { return d * min(1.0, limit * inversesqrt(max(dot(d, d), 1e-30))); }
