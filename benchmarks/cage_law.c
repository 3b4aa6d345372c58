/* The cage in a rigid rib with the fixed half film, lengths in clearances and phase for time, at any speed.

   numbers.h holds REFERENCE, the constants of `problem.constants` at the speed at which `ratio` is 1, and POWERS, by
   which each grows with the speed. */
#include <math.h>
#include "numbers.h"

enum {
    FILM, CONTACT, HYSTERESIS, ONSET, WIDTH, CENTRE2, SPRING_X, SPRING_Y, CUBIC, DAMPING, CROSS, TURNING, IMPACT, WEIGHT
};

/* The positive part, smooth within `width` of zero. */
static double plus(double a, double width) {
    double t = (a + width) / (2 * width);
    return t <= 0 ? 0 : t >= 1 ? a : 2 * width * t * t * t * t * (t * (t - 3) + 2.5);
}

/* Film and contact over (x, y): what the land does to the cage. */
static void land(const double *p, const double *z, double *force) {
    double x = z[0], y = z[1], u = z[2], v = z[3];
    double eps = sqrt(x * x + y * y + p[CENTRE2]), excess = plus(eps - p[ONSET], p[WIDTH]), normal = 0;
    if (excess > 0)
        normal = p[CONTACT] * pow(excess, 10.0 / 9) * plus(1 + p[HYSTERESIS] * (x * u + y * v) / eps, 1e-4);
    double kept = 1 - excess / eps, nx = kept * x, ny = kept * y, e2 = nx * nx + ny * ny;
    double iso = M_PI_2 / ((1 - e2) * sqrt(1 - e2)), radial = 3 * iso / (1 - e2);
    double skew = 2 / ((1 - e2) * (1 - e2) * sqrt(e2 + p[CENTRE2]));
    double wx = 2 * u + y, wy = 2 * v - x, a = nx * wx + ny * wy, b = nx * wy - ny * wx;
    double along = radial * a - skew * b, across = skew * a;
    force[0] = -p[FILM] * (iso * wx + nx * along + ny * across) - normal / eps * x;
    force[1] = -p[FILM] * (iso * wy + ny * along - nx * across) - normal / eps * y;
}

void rates(double ratio, double cosine, double sine, const double *z, double *f) {
    static _Thread_local double known, p[WEIGHT + 1];
    if (ratio != known) {
        for (int i = 0; i <= WEIGHT; i++) p[i] = REFERENCE[i] * pow(ratio, POWERS[i]);
        known = ratio;
    }
    double force[2], hold = p[CUBIC] * (z[0] * z[0] + z[1] * z[1]);
    land(p, z, force);
    f[0] = z[2];
    f[1] = z[3];
    f[2] = force[0] + p[TURNING] * cosine + p[IMPACT] * sine - (p[SPRING_X] + hold) * z[0] - p[CROSS] * z[1] -
           p[DAMPING] * z[2];
    f[3] = force[1] + p[TURNING] * sine - p[WEIGHT] - (p[SPRING_Y] + hold) * z[1] + p[CROSS] * z[0] - p[DAMPING] * z[3];
}
