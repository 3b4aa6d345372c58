/* x'' + DAMPING x' - x + x^3 = force cos(phase), phase for time at the drive's frequency: x' = dx/dphase. */
#include "numbers.h"

void rates(double force, double cosine, double sine, const double *z, double *f) {
    (void)sine;
    f[0] = z[1];
    f[1] = (z[0] - z[0] * z[0] * z[0] + force * cosine) / (SPEED * SPEED) - DAMPING / SPEED * z[1];
}
