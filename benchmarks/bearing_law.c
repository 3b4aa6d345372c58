/* The whole bearing guided by its outer ring, bars linear, half film, over the cage's angle by Runge and Kutta's method.

   Written for speed from the laws of `jaxcage/models/whole`: rollers in polar places about the outer ring's centre.
   State: lag[N], spin[N], radius[N], radial[N], orbit[N]; x, y, vx, vy, cage speed, ring x, y, vx, vy. */
#include <math.h>

enum { N = 13, SIZE = 5 * N + 9 };

typedef struct {
    double half, outer, inner, speed, k, race_damping, race_width;
    double a, b, c, d, least;
    double room, bar, bar_damping, bar_width, friction, saturation;
    double gap, land, film, petroff, film_centre, onset, land_width, stiffness, land_damping, land_friction;
    double roller, roller_inertia, cage, cage_inertia, eccentricity, ring, mounting, gravity, load;
} Law;

static double plus(double u, double width) {
    double t = (u + width) / (2 * width);
    return t <= 0 ? 0 : t >= 1 ? u : 2 * width * t * t * t * t * (t * (t - 3) + 2.5);
}

static double line(double overlap, double rate, double k, double damping, double width) {
    double p = plus(overlap, width);
    return p > 0 ? k * pow(p, 10.0 / 9) * plus(1 + damping * rate, 1e-4) : 0;
}

static double traction(const Law *w, double u) {
    double size = sqrt(u * u + w->least * w->least);
    return u / size * ((w->a + w->b * size) * exp(-w->c * size) + w->d);
}

static double sat(double u, double at) { return u / sqrt(u * u + at * at); }

/* Rates over the cage's angle. */
static void rates(const Law *w, double angle, const double *y, double *f) {
    const double *lag = y, *spin = y + N, *radius = y + 2 * N, *radial = y + 3 * N, *orbit = y + 4 * N, *o = y + 5 * N;
    double x = o[0], yc = o[1], vx = o[2], vy = o[3], omega = o[4], rx = o[5], ry = o[6], rvx = o[7], rvy = o[8];
    double fx = 0, fy = 0, moment = 0, ix = 0, iy = -w->load - w->ring * w->gravity;
    for (int j = 0; j < N; j++) {
        double at = angle + 2 * M_PI / N * j, pc = cos(at), ps = sin(at), lc = cos(lag[j]), ls = sin(lag[j]);
        double c = pc * lc - ps * ls, s = ps * lc + pc * ls, across = radius[j] * orbit[j];

        double depth = radius[j] + w->half - w->outer, load = line(depth, radial[j], w->k, w->race_damping, w->race_width);
        double arm = w->half - depth / 2, pull = traction(w, -(across + spin[j] * arm)) * load;
        double out = -load, tangent = pull, turn = arm * pull;

        double dx = radius[j] - (rx * c + ry * s), dy = rx * s - ry * c, far = sqrt(dx * dx + dy * dy);
        double nx = dx / far, ny = dy / far;
        double du = radial[j] - (rvx * c + rvy * s), dv = across - (rvy * c - rvx * s);
        double away = nx * du + ny * dv, along = nx * dv - ny * du;
        depth = w->inner + w->half - far;
        load = line(depth, -away, w->k, w->race_damping, w->race_width);
        arm = w->half - depth / 2;
        pull = traction(w, w->speed * (far - arm) - (along - spin[j] * arm)) * load;
        double px = load * nx - pull * ny, py = load * ny + pull * nx;
        out += px;
        tangent += py;
        turn -= arm * pull;
        ix -= px * c - py * s;
        iy -= px * s + py * c;

        double where = radius[j] * ls - (yc * pc - x * ps), high = radius[j] * lc - (x * pc + yc * ps);
        double side = where >= 0 ? 1 : -1, pressed = plus(side * where - w->room / 2, w->bar_width);
        if (pressed > 0) {
            double v_along = radial[j] * ls + across * lc - (vy * pc - vx * ps);
            double v_out = radial[j] * lc - across * ls - (vx * pc + vy * ps);
            double normal = w->bar * pressed * plus(1 + w->bar_damping * side * (v_along - omega * high), 1e-4);
            double sliding = v_out + omega * where - side * w->half * (spin[j] - omega);
            double rub = -w->friction * normal * sat(sliding, w->saturation), push = -side * normal;
            out += push * ls + rub * lc;
            tangent += push * lc - rub * ls;
            turn -= side * w->half * rub;
            moment += high * side * normal + (where + side * w->half) * rub;
            fx -= rub * pc - push * ps;
            fy -= rub * ps + push * pc;
        }
        f[j] = orbit[j] - omega;
        f[N + j] = turn / w->roller_inertia;
        f[2 * N + j] = radial[j];
        f[3 * N + j] = out / w->roller - w->gravity * s + radius[j] * orbit[j] * orbit[j];
        f[4 * N + j] = (tangent / w->roller - w->gravity * c - 2 * radial[j] * orbit[j]) / radius[j];
    }
    double r = sqrt(x * x + yc * yc), gap = w->gap, ux = x / r, uy = yc / r;
    double eps = hypot(r / gap, w->film_centre), sure = r / gap / eps, excess = plus(eps - w->onset, w->land_width);
    double e = (1 - excess / eps) * r / gap, v_r = (ux * vx + uy * vy) / gap, v_t = (ux * vy - uy * vx) / gap;
    double room = 1 - e * e, root = room * sqrt(room), sense = omega >= 0 ? 1 : -1;
    double drift = omega * r / gap - 2 * v_t, cross = sense * sure * e / (room * room);
    double film_r = -(drift * cross + M_PI_2 * (1 + 2 * e * e) / (room * root) * v_r) * w->film;
    double film_t = (drift * M_PI_4 / root + 2 * cross * v_r) * w->film;
    double gone = eps - excess, turn = -w->petroff / sqrt(1 - gone * gone) * omega - r * film_t / 2;
    double normal = 0, rub = 0;
    if (excess > 0) {
        normal = w->stiffness * pow(gap * excess, 10.0 / 9) * plus(1 + w->land_damping * gap * sure * v_r, 1e-4);
        rub = -w->land_friction * normal * sat(sure * v_t * gap + omega * w->land, w->saturation);
        turn += w->land * sure * rub;
    }
    fx += (film_r - normal * sure) * ux - (film_t + rub * sure) * uy;
    fy += (film_r - normal * sure) * uy + (film_t + rub * sure) * ux;
    moment += turn;

    double ec = w->eccentricity * cos(angle), es = w->eccentricity * sin(angle), *g = f + 5 * N;
    double spinning = (moment - (ec * fy - es * fx)) / w->cage_inertia;
    g[0] = vx;
    g[1] = vy;
    g[2] = fx / w->cage + omega * omega * ec + spinning * es;
    g[3] = fy / w->cage - w->gravity + omega * omega * es - spinning * ec;
    g[4] = spinning;
    g[5] = rvx;
    g[6] = rvy;
    g[7] = (ix - w->mounting * rvx) / w->ring;
    g[8] = (iy - w->mounting * rvy) / w->ring;
    for (int i = 0; i < SIZE; i++) f[i] /= omega;
}

/* Lanes of SIZE numbers each, one law each, over `span` of the cage's angle by so many equal steps. */
void turned(long lanes, const Law *laws, const double *angles, double *states, double span, long steps) {
    double h = span / steps;
    for (long i = 0; i < lanes; i++) {
        double *y = states + i * SIZE, k1[SIZE], k2[SIZE], k3[SIZE], k4[SIZE], z[SIZE];
        for (long n = 0; n < steps; n++) {
            double at = angles[i] + n * h;
            rates(laws + i, at, y, k1);
            for (int j = 0; j < SIZE; j++) z[j] = y[j] + h / 2 * k1[j];
            rates(laws + i, at + h / 2, z, k2);
            for (int j = 0; j < SIZE; j++) z[j] = y[j] + h / 2 * k2[j];
            rates(laws + i, at + h / 2, z, k3);
            for (int j = 0; j < SIZE; j++) z[j] = y[j] + h * k3[j];
            rates(laws + i, at + h, z, k4);
            for (int j = 0; j < SIZE; j++) y[j] += h / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j]);
        }
    }
}
