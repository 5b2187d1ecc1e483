/* Vectors, quaternions and 3x3 matrices by value.
 *
 * Quaternions are (w, x, y, z); a unit quaternion of a body takes body axes to world axes. Every function
 * is written out in scalars in one fixed order of operations, so that each compiler gives the same bits.
 */
#ifndef LW_MATH_H
#define LW_MATH_H

#include <math.h>

/* An FMU defines it as nothing: it exports its interface only. */
#ifndef LW_API
#if defined(_WIN32)
#define LW_API __declspec(dllexport)
#else
#define LW_API __attribute__((visibility("default")))
#endif
#endif

/* Struct arguments of a call go through memory: inlined they stay in registers (15 % of the run time). */
#if defined(__GNUC__)
#define LW_INLINE static inline __attribute__((always_inline))
#else
#define LW_INLINE static inline
#endif

/* A double that may lie anywhere: the arrays inside a protobuf message are not aligned. */
typedef double lw_unaligned __attribute__((aligned(1)));

typedef struct { double x, y, z; } lw_vec3;
typedef struct { double w, x, y, z; } lw_quat;
/* Full matrix, named by row and column. */
typedef struct { double xx, xy, xz, yx, yy, yz, zx, zy, zz; } lw_mat3;
/* Symmetric matrix, in the order of an inertia table: Ixx, Iyy, Izz, Ixy, Ixz, Iyz. */
typedef struct { double xx, yy, zz, xy, xz, yz; } lw_sym3;

/* ---- vectors ---- */

LW_INLINE lw_vec3 lw_vec(double x, double y, double z) {
    lw_vec3 v = {x, y, z};
    return v;
}
LW_INLINE lw_vec3 lw_load3(const lw_unaligned *p) { return lw_vec(p[0], p[1], p[2]); }
LW_INLINE void lw_store3(lw_unaligned *p, lw_vec3 v) { p[0] = v.x; p[1] = v.y; p[2] = v.z; }
LW_INLINE lw_vec3 lw_add(lw_vec3 a, lw_vec3 b) { return lw_vec(a.x + b.x, a.y + b.y, a.z + b.z); }
LW_INLINE lw_vec3 lw_sub(lw_vec3 a, lw_vec3 b) { return lw_vec(a.x - b.x, a.y - b.y, a.z - b.z); }
LW_INLINE lw_vec3 lw_neg(lw_vec3 a) { return lw_vec(-a.x, -a.y, -a.z); }
LW_INLINE lw_vec3 lw_scale(double s, lw_vec3 a) { return lw_vec(s * a.x, s * a.y, s * a.z); }
LW_INLINE double lw_dot(lw_vec3 a, lw_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
LW_INLINE lw_vec3 lw_cross(lw_vec3 a, lw_vec3 b) {
    return lw_vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
LW_INLINE double lw_norm(lw_vec3 a) { return sqrt(lw_dot(a, a)); }

/* ---- quaternions ---- */

LW_INLINE lw_quat lw_quat_of(double w, double x, double y, double z) {
    lw_quat q = {w, x, y, z};
    return q;
}
LW_INLINE lw_quat lw_load4(const lw_unaligned *p) { return lw_quat_of(p[0], p[1], p[2], p[3]); }
LW_INLINE void lw_store4(lw_unaligned *p, lw_quat q) { p[0] = q.w; p[1] = q.x; p[2] = q.y; p[3] = q.z; }
LW_INLINE lw_quat lw_quat_mul(lw_quat a, lw_quat b) {
    return lw_quat_of(a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
                      a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                      a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w);
}
/* a times a rotation about z with half-angle cosine c and sine s. */
LW_INLINE lw_quat lw_quat_mul_z(lw_quat a, double c, double s) {
    return lw_quat_of(a.w * c - a.z * s, a.x * c + a.y * s, a.y * c - a.x * s, a.z * c + a.w * s);
}
LW_INLINE lw_quat lw_quat_conj(lw_quat q) { return lw_quat_of(q.w, -q.x, -q.y, -q.z); }
LW_INLINE lw_quat lw_quat_unit(lw_quat q) {
    double f = 1.0 / sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return lw_quat_of(f * q.w, f * q.x, f * q.y, f * q.z);
}

/* ---- matrices ---- */

LW_INLINE lw_mat3 lw_load9(const double *p) {
    lw_mat3 m = {p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8]};
    return m;
}
/* Rotation matrix of a unit quaternion. */
LW_INLINE lw_mat3 lw_quat_matrix(lw_quat q) {
    double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
    double xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z;
    double wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
    lw_mat3 m = {1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy),
                 2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx),
                 2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy)};
    return m;
}
LW_INLINE lw_vec3 lw_mat_vec(lw_mat3 m, lw_vec3 v) {
    return lw_vec(m.xx * v.x + m.xy * v.y + m.xz * v.z,
                  m.yx * v.x + m.yy * v.y + m.yz * v.z,
                  m.zx * v.x + m.zy * v.y + m.zz * v.z);
}
/* Transpose of m times v: from world to body if m takes body to world. */
LW_INLINE lw_vec3 lw_mat_tvec(lw_mat3 m, lw_vec3 v) {
    return lw_vec(m.xx * v.x + m.yx * v.y + m.zx * v.z,
                  m.xy * v.x + m.yy * v.y + m.zy * v.z,
                  m.xz * v.x + m.yz * v.y + m.zz * v.z);
}
LW_INLINE lw_mat3 lw_mat_mul(lw_mat3 a, lw_mat3 b) {
    lw_mat3 m = {a.xx * b.xx + a.xy * b.yx + a.xz * b.zx, a.xx * b.xy + a.xy * b.yy + a.xz * b.zy,
                 a.xx * b.xz + a.xy * b.yz + a.xz * b.zz, a.yx * b.xx + a.yy * b.yx + a.yz * b.zx,
                 a.yx * b.xy + a.yy * b.yy + a.yz * b.zy, a.yx * b.xz + a.yy * b.yz + a.yz * b.zz,
                 a.zx * b.xx + a.zy * b.yx + a.zz * b.zx, a.zx * b.xy + a.zy * b.yy + a.zz * b.zy,
                 a.zx * b.xz + a.zy * b.yz + a.zz * b.zz};
    return m;
}
LW_INLINE lw_mat3 lw_mat_transpose(lw_mat3 a) {
    lw_mat3 m = {a.xx, a.yx, a.zx, a.xy, a.yy, a.zy, a.xz, a.yz, a.zz};
    return m;
}
LW_INLINE lw_vec3 lw_row_x(lw_mat3 m) { return lw_vec(m.xx, m.xy, m.xz); }
LW_INLINE lw_vec3 lw_row_y(lw_mat3 m) { return lw_vec(m.yx, m.yy, m.yz); }
LW_INLINE lw_vec3 lw_row_z(lw_mat3 m) { return lw_vec(m.zx, m.zy, m.zz); }
LW_INLINE lw_vec3 lw_column_x(lw_mat3 m) { return lw_vec(m.xx, m.yx, m.zx); }
LW_INLINE lw_vec3 lw_column_y(lw_mat3 m) { return lw_vec(m.xy, m.yy, m.zy); }
LW_INLINE lw_vec3 lw_column_z(lw_mat3 m) { return lw_vec(m.xz, m.yz, m.zz); }

/* ---- symmetric matrices ---- */

LW_INLINE lw_sym3 lw_load_sym(const double *p) {
    lw_sym3 s = {p[0], p[1], p[2], p[3], p[4], p[5]};
    return s;
}
LW_INLINE lw_vec3 lw_sym_vec(lw_sym3 s, lw_vec3 v) {
    return lw_vec(s.xx * v.x + s.xy * v.y + s.xz * v.z,
                  s.xy * v.x + s.yy * v.y + s.yz * v.z,
                  s.xz * v.x + s.yz * v.y + s.zz * v.z);
}
/* The symmetric part that is stored of a product known to be symmetric: a times b transposed. */
LW_INLINE lw_sym3 lw_mat_mul_t_sym(lw_mat3 a, lw_mat3 b) {
    lw_sym3 s = {a.xx * b.xx + a.xy * b.xy + a.xz * b.xz, a.yx * b.yx + a.yy * b.yy + a.yz * b.yz,
                 a.zx * b.zx + a.zy * b.zy + a.zz * b.zz, a.xx * b.yx + a.xy * b.yy + a.xz * b.yz,
                 a.xx * b.zx + a.xy * b.zy + a.xz * b.zz, a.yx * b.zx + a.yy * b.zy + a.yz * b.zz};
    return s;
}
/* r s rᵀ: a symmetric tensor of the body in world axes. */
LW_INLINE lw_sym3 lw_rotate_sym(lw_mat3 r, lw_sym3 s) {
    lw_mat3 full = {s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz};
    return lw_mat_mul_t_sym(lw_mat_mul(r, full), r);
}

#endif
