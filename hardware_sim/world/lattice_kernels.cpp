#include "hardware_sim/world/lattice_kernels.h"

#include <cmath>
#include <initializer_list>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SELVEDGE_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define SELVEDGE_CLONES
#endif

namespace selvedge::hardware_sim::lattice {

SELVEDGE_CLONES
void edges_along(ConstRow p, ConstRow v, Row f, int n, double h, double area, double k, double c, double* scratch) {
  double* __restrict ex = scratch;
  double* __restrict ey = scratch + (n + 2);
  double* __restrict ez = scratch + 2 * (n + 2);
  const double per_h2 = 1 / (h * h);
  ex[0] = ey[0] = ez[0] = ex[n] = ey[n] = ez[n] = 0;
  for (int i = 0; i < n - 1; ++i) {
    const double dx = p.x[i + 1] - p.x[i], dy = p.y[i + 1] - p.y[i], dz = p.z[i + 1] - p.z[i];
    const double wx = v.x[i + 1] - v.x[i], wy = v.y[i + 1] - v.y[i], wz = v.z[i + 1] - v.z[i];
    const double strain = 0.5 * ((dx * dx + dy * dy + dz * dz) * per_h2 - 1);
    const double rate = (dx * wx + dy * wy + dz * wz) * per_h2;
    const double s = area * (k * strain + c * rate) * per_h2;
    ex[i + 1] = s * dx;
    ey[i + 1] = s * dy;
    ez[i + 1] = s * dz;
  }
  for (int i = 0; i < n; ++i) {
    f.x[i] += ex[i + 1] - ex[i];
    f.y[i] += ey[i + 1] - ey[i];
    f.z[i] += ez[i + 1] - ez[i];
  }
}

SELVEDGE_CLONES
void edges_across(ConstRow p0, ConstRow v0, Row f0, ConstRow p1, ConstRow v1, Row f1, int n, double h, double area,
                  double end_share, double k, double c) {
  const double per_h2 = 1 / (h * h);
  const auto edge = [&](int i, double a) {
    const double dx = p1.x[i] - p0.x[i], dy = p1.y[i] - p0.y[i], dz = p1.z[i] - p0.z[i];
    const double wx = v1.x[i] - v0.x[i], wy = v1.y[i] - v0.y[i], wz = v1.z[i] - v0.z[i];
    const double strain = 0.5 * ((dx * dx + dy * dy + dz * dz) * per_h2 - 1);
    const double rate = (dx * wx + dy * wy + dz * wz) * per_h2;
    const double s = a * (k * strain + c * rate) * per_h2;
    f0.x[i] += s * dx;
    f0.y[i] += s * dy;
    f0.z[i] += s * dz;
    f1.x[i] -= s * dx;
    f1.y[i] -= s * dy;
    f1.z[i] -= s * dz;
  };
  edge(0, area * end_share);
#pragma GCC ivdep
  for (int i = 1; i < n - 1; ++i) edge(i, area);
  edge(n - 1, area * end_share);
}

SELVEDGE_CLONES
void cells(ConstRow p0, ConstRow v0, Row f0, ConstRow p1, ConstRow v1, Row f1, int n, double hu, double hv,
           double shear, double shear_damping, double bend, double bend_damping, double* scratch) {
  // Per cell and axis: plus = force on its own top-left node by shear with both signs, minus likewise; see below.
  double* __restrict q[3] = {scratch, scratch + (n + 2), scratch + 2 * (n + 2)};
  double* __restrict s[3] = {scratch + 3 * (n + 2), scratch + 4 * (n + 2), scratch + 5 * (n + 2)};
  double* __restrict t[3] = {scratch + 6 * (n + 2), scratch + 7 * (n + 2), scratch + 8 * (n + 2)};
  for (int axis = 0; axis < 3; ++axis)
    for (double* plane : {q[axis], s[axis], t[axis]}) plane[0] = plane[n] = 0;
  const double area = hu * hv, half_u = 0.5 / hu, half_v = 0.5 / hv, per_area = 1 / area;
  for (int i = 0; i < n - 1; ++i) {
    const double ax = half_u * (p0.x[i + 1] - p0.x[i] + p1.x[i + 1] - p1.x[i]);
    const double ay = half_u * (p0.y[i + 1] - p0.y[i] + p1.y[i + 1] - p1.y[i]);
    const double az = half_u * (p0.z[i + 1] - p0.z[i] + p1.z[i + 1] - p1.z[i]);
    const double bx = half_v * (p1.x[i] - p0.x[i] + p1.x[i + 1] - p0.x[i + 1]);
    const double by = half_v * (p1.y[i] - p0.y[i] + p1.y[i + 1] - p0.y[i + 1]);
    const double bz = half_v * (p1.z[i] - p0.z[i] + p1.z[i + 1] - p0.z[i + 1]);
    const double aax = half_u * (v0.x[i + 1] - v0.x[i] + v1.x[i + 1] - v1.x[i]);
    const double aay = half_u * (v0.y[i + 1] - v0.y[i] + v1.y[i + 1] - v1.y[i]);
    const double aaz = half_u * (v0.z[i + 1] - v0.z[i] + v1.z[i + 1] - v1.z[i]);
    const double bbx = half_v * (v1.x[i] - v0.x[i] + v1.x[i + 1] - v0.x[i + 1]);
    const double bby = half_v * (v1.y[i] - v0.y[i] + v1.y[i + 1] - v0.y[i + 1]);
    const double bbz = half_v * (v1.z[i] - v0.z[i] + v1.z[i + 1] - v0.z[i + 1]);
    const double angle = ax * bx + ay * by + az * bz;
    const double rate = aax * bx + aay * by + aaz * bz + ax * bbx + ay * bby + az * bbz;
    const double stress = area * (shear * angle + shear_damping * rate);
    q[0][i + 1] = stress * bx * half_u;
    q[1][i + 1] = stress * by * half_u;
    q[2][i + 1] = stress * bz * half_u;
    s[0][i + 1] = stress * ax * half_v;
    s[1][i + 1] = stress * ay * half_v;
    s[2][i + 1] = stress * az * half_v;
    // Twist x_uv = (p00 − p10 − p01 + p11)/(hu hv); energy bend · |x_uv|² · area.
    t[0][i + 1] = 2 * per_area *
                  (bend * (p0.x[i] - p0.x[i + 1] - p1.x[i] + p1.x[i + 1]) +
                   bend_damping * (v0.x[i] - v0.x[i + 1] - v1.x[i] + v1.x[i + 1]));
    t[1][i + 1] = 2 * per_area *
                  (bend * (p0.y[i] - p0.y[i + 1] - p1.y[i] + p1.y[i + 1]) +
                   bend_damping * (v0.y[i] - v0.y[i + 1] - v1.y[i] + v1.y[i + 1]));
    t[2][i + 1] = 2 * per_area *
                  (bend * (p0.z[i] - p0.z[i + 1] - p1.z[i] + p1.z[i + 1]) +
                   bend_damping * (v0.z[i] - v0.z[i + 1] - v1.z[i] + v1.z[i + 1]));
  }
  double* const top[3] = {f0.x, f0.y, f0.z};
  double* const bottom[3] = {f1.x, f1.y, f1.z};
  for (int axis = 0; axis < 3; ++axis) {
    double* __restrict f_top = top[axis];
    double* __restrict f_bottom = bottom[axis];
    const double *qa = q[axis], *sa = s[axis], *ta = t[axis];
    for (int i = 0; i < n; ++i) {
      f_top[i] += qa[i + 1] + sa[i + 1] - ta[i + 1] - qa[i] + sa[i] + ta[i];
      f_bottom[i] += qa[i + 1] - sa[i + 1] + ta[i + 1] - qa[i] - sa[i] - ta[i];
    }
  }
}

SELVEDGE_CLONES
void bends(ConstRow p0, ConstRow v0, ConstRow p1, ConstRow v1, ConstRow p2, ConstRow v2, double* const out[9], int n,
           double h, double area, double bend, double damping) {
  const double stiffness = bend * area / (h * h), viscosity = damping * area / (h * h * h * h), h2 = h * h;
  for (int i = 0; i < n; ++i) {
    const double ex = p1.x[i] - p0.x[i], ey = p1.y[i] - p0.y[i], ez = p1.z[i] - p0.z[i];
    const double gx = p2.x[i] - p1.x[i], gy = p2.y[i] - p1.y[i], gz = p2.z[i] - p1.z[i];
    const double d = h2 + ex * gx + ey * gy + ez * gz;
    const double kx = 2 / d * (ey * gz - ez * gy), ky = 2 / d * (ez * gx - ex * gz), kz = 2 / d * (ex * gy - ey * gx);
    const double half = 0.5 * (kx * kx + ky * ky + kz * kz), s = 2 * stiffness / d;
    // Derivatives by the first and the second edge.
    const double ax = s * (gy * kz - gz * ky - half * gx), bx = s * (ky * ez - kz * ey - half * ex);
    const double ay = s * (gz * kx - gx * kz - half * gy), by = s * (kz * ex - kx * ez - half * ey);
    const double az = s * (gx * ky - gy * kx - half * gz), bz = s * (kx * ey - ky * ex - half * ez);
    const double wx = viscosity * (v0.x[i] - 2 * v1.x[i] + v2.x[i]);
    const double wy = viscosity * (v0.y[i] - 2 * v1.y[i] + v2.y[i]);
    const double wz = viscosity * (v0.z[i] - 2 * v1.z[i] + v2.z[i]);
    out[0][i] = ax - wx;
    out[1][i] = ay - wy;
    out[2][i] = az - wz;
    out[3][i] = bx - ax + 2 * wx;
    out[4][i] = by - ay + 2 * wy;
    out[5][i] = bz - az + 2 * wz;
    out[6][i] = -bx - wx;
    out[7][i] = -by - wy;
    out[8][i] = -bz - wz;
  }
}

SELVEDGE_CLONES
void drag(ConstRow p, ConstRow up, ConstRow down, ConstRow v, Row f, int n, const double* area, const double air[3],
          double normal, double tangent, double fade) {
  for (int i = 0; i < n; ++i) {
    const int l = i > 0 ? i - 1 : 0, r = i < n - 1 ? i + 1 : n - 1;
    const double ax = p.x[r] - p.x[l], ay = p.y[r] - p.y[l], az = p.z[r] - p.z[l];
    const double bx = down.x[i] - up.x[i], by = down.y[i] - up.y[i], bz = down.z[i] - up.z[i];
    double nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
    const double per_length = 1 / std::sqrt(nx * nx + ny * ny + nz * nz + 1e-300);
    nx *= per_length;
    ny *= per_length;
    nz *= per_length;
    const double ux = v.x[i] - air[0], uy = v.y[i] - air[1], uz = v.z[i] - air[2];
    const double across = ux * nx + uy * ny + uz * nz;
    const double coefficient = normal * std::fabs(across) / (1 + fade * across * across);
    const double s = (tangent - coefficient) * across;  // what v_N adds beyond the tangential law
    f.x[i] += area[i] * (s * nx - tangent * ux);
    f.y[i] += area[i] * (s * ny - tangent * uy);
    f.z[i] += area[i] * (s * nz - tangent * uz);
  }
}

}  // namespace selvedge::hardware_sim::lattice
