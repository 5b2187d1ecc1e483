#include "lw_plate.h"

#include <string.h>

#include "lw_expression.h"

static const double pi = 3.14159265358979323846264338327950;
static const double degree = 0.01745329251994329576923690768489;

/* Coefficients of Li, Goodwill, Wang & Ristroph 2022. */
static const double C_L1 = 5.2, C_L2 = 0.95, C_D0 = 0.1, C_D1 = 5.0, C_D2 = 1.9, C_R = 1.1;
/* Coefficients of Andersen, Pesavento & Wang 2005. */
static const double A_CT = 1.2, A_CR = 3.14159265358979323846264338327950, A_A = 1.4, A_B = 1.0;
static const double A_MU = 0.2, A_NU = 0.2;

/* Force along the plate and along its normal, and torque about its span axis. */
typedef struct { double x, y, torque; } planar_wrench;

/* Motion of the section relative to the air: u along the plate, w along the normal, omega about z. */
typedef struct { double u, w, speed, omega; } section_motion;

static double sign(double x) { return (double)((x > 0.0) - (x < 0.0)); }

/* Lift and drag blended from attached to stalled flow, acting at a centre of pressure that moves;
 * rotational lift at the centre; rotational drag in closed form: the local drag 1/2 rho C_D2 |omega x|
 * omega x integrated along the chord has no resultant and the moment rho s C_D2 c^4 |omega| omega / 64. */
static planar_wrench ristroph(double density, double chord, double span, section_motion m) {
    const double q = 0.5 * density * chord * span;
    planar_wrench out = {0.0, 0.0, -q * C_D2 * chord * chord * chord * fabs(m.omega) * m.omega / 32.0};
    if (m.speed == 0.0) {
        return out;
    }
    const double alpha = atan2(fabs(m.w), fabs(m.u));
    const double sine = fabs(m.w) / m.speed, cosine = fabs(m.u) / m.speed;
    const double f = 0.5 * (1.0 - tanh((alpha - 14.0 * degree) / (6.0 * degree)));
    const double lift = f * C_L1 * sine + (1.0 - f) * C_L2 * 2.0 * sine * cosine;
    const double drag = f * (C_D0 + C_D1 * sine * sine) + (1.0 - f) * C_D2 * sine * sine;
    const double ahead = f * (0.3 - 3.5 * alpha * alpha) + (1.0 - f) * 0.2 * (1.0 - 2.0 * alpha / pi);
    const double l = -q * lift * m.speed * sign(m.u) * sign(m.w), d = q * drag * m.speed;
    const double r = q * chord * C_R * m.omega;
    const double normal = l * m.u - d * m.w; /* at the centre of pressure */
    out.x = -l * m.w - d * m.u - r * m.w;
    out.y = normal + r * m.u;
    out.torque += ahead * chord * sign(m.u) * normal;
    return out;
}

/* Circulation with a translational and a rotational part, quadratic drag, and a torque against the
 * rotation. Its steady term mu is scaled with the speed relative to the air, where the source has the
 * constant speed of the fall. */
static planar_wrench andersen(double density, double chord, double span, section_motion m) {
    const double a = 0.5 * chord, a2 = a * a;
    planar_wrench out = {0.0, 0.0, 0.0};
    out.torque = -pi * density * span * a2 * a2 * (A_MU * m.speed / a + A_NU * fabs(m.omega)) * m.omega;
    if (m.speed == 0.0) {
        return out;
    }
    const double u2 = m.u * m.u, w2 = m.w * m.w;
    const double circulation = -2.0 * A_CT * a * m.u * m.w / m.speed + 2.0 * A_CR * a2 * m.omega;
    const double l = density * span * circulation;
    const double d = density * span * a * (A_A - A_B * (u2 - w2) / (u2 + w2)) * m.speed;
    out.x = -l * m.w - d * m.u;
    out.y = l * m.u - d * m.w;
    return out;
}

/* Lift, drag and moment about the middle of the chord from the curves of a table over the angle of attack. */
static planar_wrench tabulated(const lw_plates *plates, double chord, double span, section_motion m) {
    const double q = 0.5 * plates->density * chord * span, alpha = atan2(-m.w, m.u);
    const double *curves = plates->curves;
    const int size = plates->curve_size;
    const double l = q * lw_curve(curves, alpha).value * m.speed;
    const double d = q * lw_curve(curves + size, alpha).value * m.speed;
    const double moment = q * chord * lw_curve(curves + 2 * size, alpha).value * m.speed * m.speed;
    const planar_wrench out = {-l * m.w - d * m.u, l * m.u - d * m.w, moment};
    return out;
}

static planar_wrench circulatory(const lw_plates *plates, double chord, double span, section_motion m) {
    switch (plates->coefficients) {
    case LW_PLATE_ANDERSEN: return andersen(plates->density, chord, span, m);
    case LW_PLATE_TABLE: return tabulated(plates, chord, span, m);
    default: return ristroph(plates->density, chord, span, m);
    }
}

/* Kirchhoff's equations for the added momentum p = m_n w n and angular momentum I_a omega_z e_z, less the
 * terms in the body's own acceleration: force -dp/dt, torque -d(I_a omega_z e_z)/dt - v x p. The rate is that
 * of the air along n, less what of the centre's acceleration is none of the body's. */
static void add_added_mass(double mass, double inertia, lw_vec3 v, lw_vec3 omega, double rate,
                           lw_vec3 *force, lw_vec3 *torque) {
    const double p = mass * v.y;
    const lw_vec3 turn = lw_vec(-omega.z, 0.0, omega.x); /* omega x n */
    *force = lw_sub(*force, lw_scale(p, turn));
    force->y += mass * (rate - lw_dot(v, turn));
    torque->x += v.z * p - inertia * omega.z * omega.y;
    torque->y += inertia * omega.z * omega.x;
    torque->z -= v.x * p;
}

/* How a plate or wing moves: in W, and its angular velocity in the body frame as well. */
typedef struct {
    lw_vec3 position, linear, angular;
    lw_mat3 rotation;
    lw_vec3 omega;
} plate_motion;

/* A strip: its chord and width, and where its centre is in the body frame [m]. */
typedef struct { double chord, span, x, z; } plate_strip;

/* Strip k of plate or wing i, from -z on. */
static plate_strip strip_of(const lw_plates *plates, int i, int k) {
    const int n = plates->strips;
    const double chord = plates->size[2 * i], span = plates->size[2 * i + 1];
    plate_strip strip = {chord, span / n, 0.0, span * (2 * k + 1 - n) / (2 * n)};
    if (plates->planform) {
        const double *row = plates->planform + 3 * (i * n + k);
        strip.chord *= row[0];
        strip.x = chord * row[1];
        strip.z += span * row[2];
    }
    return strip;
}

/* Where the centre of a strip is in W, and how fast. Where x or z is zero nothing is added to anything. */
static void strip_centre(const plate_motion *plate, plate_strip strip, lw_vec3 *position, lw_vec3 *velocity) {
    *position = plate->position, *velocity = plate->linear;
    if (strip.x != 0.0 || strip.z != 0.0) {
        const lw_vec3 arm = lw_mat_vec(plate->rotation, lw_vec(strip.x, 0.0, strip.z));
        *position = lw_add(*position, arm);
        *velocity = lw_add(*velocity, lw_cross(plate->angular, arm));
    }
}

/* Force on a strip, and torque about the centre of mass, in the body frame. Where x or z is zero nothing is added
 * to anything, so that one strip has the bits of a plate without strips. */
static void strip_wrench(const lw_plates *plates, double t, const plate_motion *plate, plate_strip strip,
                         lw_vec3 *force, lw_vec3 *torque) {
    const lw_vec3 omega = plate->omega;
    const double chord = strip.chord, span = strip.span, x = strip.x, z = strip.z;
    lw_vec3 position, velocity;
    strip_centre(plate, strip, &position, &velocity);
    const lw_wind_sample air = lw_wind_at(&plates->wind, t, position, velocity);
    const lw_vec3 v = lw_mat_tvec(plate->rotation, lw_sub(velocity, air.velocity));
    double rate = lw_mat_tvec(plate->rotation, air.rate).y;
    const section_motion section = {v.x, v.y, sqrt(v.x * v.x + v.y * v.y), omega.z};
    const planar_wrench planar = circulatory(plates, chord, span, section);
    const lw_added_mass added = lw_plate_added_mass(plates->density, chord, span, 1);
    *force = lw_vec(planar.x, planar.y, 0.0), *torque = lw_vec(0.0, 0.0, planar.torque);
    if (z != 0.0) rate -= z * omega.y * omega.z; /* (omega x (omega x r)) . n */
    if (x != 0.0) rate -= x * omega.y * omega.x;
    add_added_mass(added.normal, added.span, v, omega, rate, force, torque);
    if (z != 0.0) *torque = lw_add(*torque, lw_vec(-z * force->y, z * force->x, 0.0));
    if (x != 0.0) *torque = lw_add(*torque, lw_vec(0.0, -x * force->z, x * force->y));
}

static plate_motion motion_of(const lw_plates *plates, int i, const lw_motion *motion) {
    const int32_t b = plates->body[i];
    plate_motion plate = {lw_load3(motion->position + 3 * b), lw_load3(motion->linear + 3 * b),
                          lw_load3(motion->angular + 3 * b),
                          lw_quat_matrix(lw_load4(motion->orientation + 4 * b)), {0.0, 0.0, 0.0}};
    plate.omega = lw_mat_tvec(plate.rotation, plate.angular);
    return plate;
}

static int evaluate(const lw_plates *plates, int i, double t, const lw_motion *motion,
                    lw_unaligned *force, lw_unaligned *torque) {
    const int n = plates->strips;
    const plate_motion plate = motion_of(plates, i, motion);
    lw_vec3 f = {0.0, 0.0, 0.0}, m = {0.0, 0.0, 0.0};
    for (int k = 0; k < n; ++k) { /* from -z to z */
        lw_vec3 strip_f, strip_m;
        strip_wrench(plates, t, &plate, strip_of(plates, i, k), &strip_f, &strip_m);
        f = k ? lw_add(f, strip_f) : strip_f;
        m = k ? lw_add(m, strip_m) : strip_m;
    }
    f = lw_mat_vec(plate.rotation, f);
    m = lw_mat_vec(plate.rotation, m);
    lw_store3(force, f);
    lw_store3(torque, m);
    return isfinite(f.x + f.y + f.z + m.x + m.y + m.z);
}

lw_added_mass lw_plate_added_mass(double density, double chord, double span, int strips) {
    const double a2 = 0.25 * chord * chord, mass = pi * density * a2 * span, n = strips;
    const lw_added_mass added = {mass, mass * (span * span * (1.0 - 1.0 / (n * n)) / 12.0), mass * a2 / 8.0};
    return added;
}

static void plate_inertia(const lw_plates *plates, int i, lw_unaligned *a) {
    const double *size = plates->size + 2 * i;
    const lw_added_mass added = lw_plate_added_mass(plates->density, size[0], size[1], plates->strips);
    a[1 * 6 + 1] = added.normal;
    a[3 * 6 + 3] = added.chord;
    a[5 * 6 + 5] = added.span;
}

/* The sum of the strips' own, carried to the centre of mass: w of a strip is w - z omega_x + x omega_z. */
static void wing_inertia(const lw_plates *plates, int i, lw_unaligned *a) {
    static const int at[] = {1, 3, 5}; /* w, omega_x, omega_z among the six */
    for (int k = 0; k < plates->strips; ++k) {
        const plate_strip strip = strip_of(plates, i, k);
        const lw_added_mass added = lw_plate_added_mass(plates->density, strip.chord, strip.span, 1);
        const double carried[] = {1.0, -strip.z, strip.x};
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column)
                a[at[row] * 6 + at[column]] += added.normal * (carried[row] * carried[column]);
        a[5 * 6 + 5] += added.span;
    }
}

int lw_plates_evaluate(const lw_plates *plates, double t, const lw_motion *motion,
                       const lw_wrench *wrench) {
    int status = 0;
    for (int i = 0; i < plates->n; ++i) {
        if (!evaluate(plates, i, t, motion, wrench->force + 3 * i, wrench->torque + 3 * i) && !status) {
            status = 1 + i;
        }
        if (wrench->added_inertia) {
            lw_unaligned *a = wrench->added_inertia + 36 * i;
            memset(a, 0, 36 * sizeof *a);
            (plates->planform ? wing_inertia : plate_inertia)(plates, i, a);
        }
    }
    return status;
}

int lw_plates_wind_fault(const lw_plates *plates, int i, double t, const lw_motion *motion, double *place) {
    const plate_motion plate = motion_of(plates, i, motion);
    for (int k = 0; k < plates->strips; ++k) {
        lw_vec3 r, v;
        strip_centre(&plate, strip_of(plates, i, k), &r, &v);
        lw_store3(place, r), lw_store3(place + 3, v);
        if (!isfinite(r.x + r.y + r.z + v.x + v.y + v.z)) return 0;
        const int fault = lw_wind_fault(lw_wind_at(&plates->wind, t, r, v));
        if (fault) return fault;
    }
    return 0;
}
