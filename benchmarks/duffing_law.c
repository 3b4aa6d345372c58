/* x'' + DAMPING x' + LINEAR x + x^3 = FORCE cos(phase), phase for time: x' = dx/dphase, `ratio` the drive's frequency
   over UNIT. */
#include "numbers.h"

void rates(double ratio, double cosine, double sine, const double *z, double *f) {
    const double per_w = 1 / (ratio * UNIT);
    (void)sine;
    f[0] = z[1];
    f[1] = ((FORCE * cosine - LINEAR * z[0] - z[0] * z[0] * z[0]) * per_w - DAMPING * z[1]) * per_w;
}
