/* The cage by Rosenbrock methods and the classical Runge-Kutta method with equal steps: eight lanes to a vector, two
   vectors to a block, blocks on all cores.

   The floor of the benchmark: the formulas of the fixed half film, the land contact and the elastic support in a rigid
   rib, with their Jacobian, written out for this one model. Lengths in clearances, phase tau for time: a state is
   (x, y, x', y') with x' = dx/dtau. Constants and states come as columns of `lanes` numbers, a multiple of 16.
*/
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "tableaux.h"
#if defined(__AVX512F__) && defined(__AVX512DQ__)
#include <immintrin.h>
#endif

#define WIDTH 8 /* lanes to a vector */
#ifndef BLOCK
#define BLOCK 2 /* vectors to a block */
#endif
#define INLINE static inline __attribute__((always_inline))

typedef double V __attribute__((vector_size(8 * WIDTH)));
typedef long long M __attribute__((vector_size(8 * WIDTH)));

typedef struct {
    V film, contact, hysteresis, onset, width, centre2, spring_x, spring_y;
    V cubic, damping, cross, turning, impact, weight;
} Constants;
#define N_CONSTANTS (sizeof(Constants) / sizeof(V))

typedef struct {
    V x, y, u, v;
} State;

INLINE V splat(double a) { return a - (V){}; }

INLINE V choose(M mask, V a, V b) { return (V)((mask & (M)a) | (~mask & (M)b)); }

INLINE int any(M mask) {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    return _mm512_movepi64_mask((__m512i)mask) != 0;
#else
    long long found = 0;
    for (int i = 0; i < WIDTH; i++) found |= mask[i];
    return found != 0;
#endif
}

/* 1/sqrt(a): a table value of 14 bits and one step of order four, less work than root and division. */
INLINE V rsqrt(V a) {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    V r = (V)_mm512_rsqrt14_pd((__m512d)a), d = 1 - (a * r) * r;
    return r + (r * d) * (0.5 + d * (0.375 + d * 0.3125));
#else
    V r;
    for (int i = 0; i < WIDTH; i++) r[i] = 1 / sqrt(a[i]);
    return r;
#endif
}

/* a^(1/9) for normal a > 0: r = a^(-1/9) from the exponent's bits, two steps of r (1 - d)^(-1/9), d = 1 - a r^9. */
INLINE V ninth_root(V a) {
    V bits = __builtin_convertvector((M)a, V);
    V r = (V)__builtin_convertvector(5118828576444464000.0 - bits * (1.0 / 9), M);
    for (int i = 0; i < 2; i++) {
        V r3 = r * r * r, d = 1 - a * (r3 * r3 * r3);
        r += r * d * (1.0 / 9 + d * (5.0 / 81 + d * (95.0 / 2187 + d * (665.0 / 19683))));
    }
    V r2 = r * r, r4 = r2 * r2;
    return a * (r4 * r4);
}

/* Where the cage is. The film's scale times its matrix is I iso + n n^T rad - (n t^T + t n^T) skew with n = kept (x, y)
   and t = (-n_y, n_x). */
typedef struct {
    V per_eps, kept, nx, ny, inverse, iso, rad, skew, q2;
    M touching;
    int contact; /* whether any lane touches */
    V excess, slope;
} Place;

INLINE Place place(const Constants *p, V x, V y) {
    Place g;
    V eps2 = x * x + y * y + p->centre2;
    g.per_eps = rsqrt(eps2);
    V over = eps2 * g.per_eps - p->onset;
    g.touching = over > -p->width;
    g.contact = any(g.touching);
    g.nx = x, g.ny = y, g.kept = splat(1.0), g.excess = splat(0.0), g.slope = splat(0.0);
    V q = g.per_eps;
    if (__builtin_expect(g.contact, 0)) {
        V t = (over + p->width) * (0.5 / p->width);
        t = choose(t < 0.0, splat(0.0), choose(t > 1.0, splat(1.0), t));
        V t2 = t * t;
        V inside = 2 * p->width * t2 * t2 * (t * (t - 3) + 2.5);
        g.excess = choose(over >= p->width, over, inside);
        g.slope = t2 * t * (10 + t * (6 * t - 15));
        g.kept = 1 - g.excess * g.per_eps;
        g.nx = g.kept * x, g.ny = g.kept * y;
        q = rsqrt(g.nx * g.nx + g.ny * g.ny + p->centre2);
    }
    V root = rsqrt(1 - (g.nx * g.nx + g.ny * g.ny));
    g.inverse = root * root;
    g.iso = M_PI_2 * p->film * (g.inverse * root);
    g.rad = 3 * g.iso * g.inverse;
    g.skew = 2 * p->film * g.inverse * (g.inverse * q);
    g.q2 = q * q;
    return g;
}

/* Contact force over the distance from the centre, N / eps, and with `slopes` its derivatives by (x, y, x', y'). */
INLINE V push(const Constants *p, const Place *g, State z, V *slopes) {
    M some = g->excess > 0.0;
    V safe = choose(some, g->excess, splat(1.0));
    V root = choose(some, ninth_root(safe), splat(0.0));
    V law = p->contact * g->excess * root;
    V rate = (z.x * z.u + z.y * z.v) * g->per_eps;
    V loading = 1 + p->hysteresis * rate, square = loading * loading + 1e-8;
    V norm = square * rsqrt(square);
    V hysteresis = 0.5 * (loading + norm);
    if (slopes) {
        V cx = z.x * g->per_eps, cy = z.y * g->per_eps; /* gradient of eps */
        V stiff = p->contact * (10.0 / 9) * root * g->slope * hysteresis * g->per_eps;
        V damp = law * p->hysteresis * hysteresis / norm * g->per_eps;
        V force = law * hysteresis * g->per_eps * g->per_eps;
        V turn = rate * g->per_eps;
        slopes[0] = (stiff - force) * cx + damp * (z.u * g->per_eps - turn * cx);
        slopes[1] = (stiff - force) * cy + damp * (z.v * g->per_eps - turn * cy);
        slopes[2] = damp * cx;
        slopes[3] = damp * cy;
    }
    return law * hysteresis * g->per_eps;
}

typedef struct {
    V x, y;
} Pair;

/* Film matrix times a vector. */
INLINE Pair resist(const Place *g, Pair w) {
    V a = g->nx * w.x + g->ny * w.y, b = g->nx * w.y - g->ny * w.x;
    V along = g->rad * a - g->skew * b, across = g->skew * a;
    return (Pair){g->iso * w.x + g->nx * along + g->ny * across, g->iso * w.y + g->ny * along - g->nx * across};
}

/* Acceleration at a place, the phase given by its cosine and sine. */
INLINE Pair forces(const Constants *p, const Place *g, State z, double c, double s) {
    Pair film = resist(g, (Pair){2 * z.u + z.y, 2 * z.v - z.x});
    V hardening = p->cubic * (z.x * z.x + z.y * z.y);
    V hold_x = p->spring_x + hardening, hold_y = p->spring_y + hardening;
    if (__builtin_expect(g->contact, 0)) {
        V normal = push(p, g, z, 0);
        hold_x += normal, hold_y += normal;
    }
    return (Pair){
        (p->turning * c + p->impact * s) - film.x - hold_x * z.x - p->cross * z.y - p->damping * z.u,
        (p->turning * s - p->weight) - film.y - hold_y * z.y + p->cross * z.x - p->damping * z.v,
    };
}

INLINE Pair rates(const Constants *p, State z, double c, double s) {
    Place g = place(p, z.x, z.y);
    return forces(p, &g, z, c, s);
}

typedef struct {
    V xx, xy, yx, yy;
} Square;

/* Derivative of the film's force along a direction e of n, the drive held. */
INLINE Pair film_slope(const Place *g, Pair w, V a, V b, V ex, V ey) {
    V de2 = 2 * (g->nx * ex + g->ny * ey);
    V iso = 1.5 * g->iso * g->inverse * de2, rad = 2.5 * g->rad * g->inverse * de2;
    V skew = g->skew * (2 * g->inverse - 0.5 * g->q2) * de2;
    V da = ex * w.x + ey * w.y, db = ex * w.y - ey * w.x;
    V along = g->rad * a - g->skew * b, across = g->skew * a;
    V d_along = rad * a + g->rad * da - skew * b - g->skew * db, d_across = skew * a + g->skew * da;
    return (Pair){
        iso * w.x + ex * along + g->nx * d_along + ey * across + g->ny * d_across,
        iso * w.y + ey * along + g->ny * d_along - ex * across - g->nx * d_across,
    };
}

/* Acceleration and its Jacobian by position and velocity. */
INLINE Pair linearise(const Constants *p, State z, double c, double s, Square *a_q, Square *a_v) {
    Place g = place(p, z.x, z.y);
    Pair w = {2 * z.u + z.y, 2 * z.v - z.x};
    V a = g.nx * w.x + g.ny * w.y, b = g.nx * w.y - g.ny * w.x;
    V xx = g.iso + g.rad * g.nx * g.nx + 2 * g.skew * g.nx * g.ny;
    V yy = g.iso + g.rad * g.ny * g.ny - 2 * g.skew * g.nx * g.ny;
    V xy = g.rad * g.nx * g.ny - g.skew * (g.nx * g.nx - g.ny * g.ny);
    Pair by_x, by_y;
    if (__builtin_expect(g.contact, 0)) {
        V fall = -(g.slope - g.excess * g.per_eps) * g.per_eps * g.per_eps; /* gradient of kept = fall (x, y) */
        V gx = fall * z.x, gy = fall * z.y;
        by_x = film_slope(&g, w, a, b, g.kept + z.x * gx, z.y * gx);
        by_y = film_slope(&g, w, a, b, z.x * gy, g.kept + z.y * gy);
    } else {
        by_x = film_slope(&g, w, a, b, splat(1.0), splat(0.0));
        by_y = film_slope(&g, w, a, b, splat(0.0), splat(1.0));
    }
    V r2 = z.x * z.x + z.y * z.y, bend = 2 * p->cubic, mixed = bend * z.x * z.y;
    a_q->xx = xy - by_x.x - p->spring_x - p->cubic * r2 - bend * z.x * z.x;
    a_q->xy = -xx - by_y.x - mixed - p->cross;
    a_q->yx = yy - by_x.y - mixed + p->cross;
    a_q->yy = -xy - by_y.y - p->spring_y - p->cubic * r2 - bend * z.y * z.y;
    a_v->xx = -2 * xx - p->damping, a_v->xy = -2 * xy;
    a_v->yx = a_v->xy, a_v->yy = -2 * yy - p->damping;
    if (__builtin_expect(g.contact, 0)) {
        V d[4], normal = push(p, &g, z, d);
        a_q->xx -= normal + z.x * d[0], a_q->xy -= z.x * d[1];
        a_q->yx -= z.y * d[0], a_q->yy -= normal + z.y * d[1];
        a_v->xx -= z.x * d[2], a_v->xy -= z.x * d[3];
        a_v->yx -= z.y * d[2], a_v->yy -= z.y * d[3];
    }
    return forces(p, &g, z, c, s);
}

typedef struct {
    double gamma;
    const double *alpha, *gamma_sum, *m, *a, *c;
} Tableau;

/* Whether a row of weights is the one before it with a 1 for the newest of n stages. */
INLINE int extends(const double *row, const double *before, int n) {
    int same = row[n - 1] == 1;
#pragma GCC unroll 8
    for (int j = 0; j < n - 1; j++) same &= row[j] == before[j];
    return same;
}

INLINE State plus(State a, State b) { return (State){a.x + b.x, a.y + b.y, a.u + b.u, a.v + b.v}; }

/* base + factor sum of weights times stages. Loops unroll and zero weights vanish when the program is compiled. */
INLINE State combine(State base, const double *weights, const State *k, int n, double factor) {
#pragma GCC unroll 8
    for (int j = 0; j < n; j++)
        if (weights[j] != 0) {
            double w = factor * weights[j];
            base.x += w * k[j].x, base.y += w * k[j].y, base.u += w * k[j].u, base.v += w * k[j].v;
        }
    return base;
}

/* One step of size h for all vectors of a block; `wave` holds cosine and sine of the phase at every stage.

   The vectors take turns stage by stage: the processor overlaps one's waiting with another's arithmetic. Both methods
   are stiffly accurate: a stage that evaluates where the last one did plus its result says so in its row of a. */
INLINE void step(Tableau t, int stages, const Constants *p, State *z, double h, const double *wave) {
    const double shift = 1 / (t.gamma * h), per_shift = t.gamma * h, per_h = 1 / h;
    Square a_q[BLOCK], inverse[BLOCK];
    State k[BLOCK][8], at[BLOCK], rates_now[BLOCK];
    Pair slope[BLOCK];
#pragma GCC unroll 8
    for (int b = 0; b < BLOCK; b++) {
        Square a_v;
        Pair f = linearise(p + b, z[b], wave[0], wave[1], a_q + b, &a_v);
        rates_now[b] = (State){z[b].u, z[b].v, f.x, f.y};
        at[b] = z[b];
        slope[b] = (Pair){p[b].impact * wave[0] - p[b].turning * wave[1], p[b].turning * wave[0]};
        /* (shift I - a_v - a_q / shift) u_v = r_v + a_q r_q / shift; u_q = (r_q + u_v) / shift */
        a_q[b].xx *= per_shift, a_q[b].xy *= per_shift, a_q[b].yx *= per_shift, a_q[b].yy *= per_shift;
        V xx = shift - a_v.xx - a_q[b].xx, xy = a_v.xy + a_q[b].xy;
        V yx = a_v.yx + a_q[b].yx, yy = shift - a_v.yy - a_q[b].yy;
        V per_det = 1 / (xx * yy - xy * yx);
        inverse[b] = (Square){yy * per_det, xy * per_det, yx * per_det, xx * per_det};
    }
#pragma GCC unroll 8
    for (int i = 0; i < stages; i++)
#pragma GCC unroll 8
        for (int b = 0; b < BLOCK; b++) {
            const double *row = t.a + i * stages;
            State *own = k[b];
            if (i > 0 && row[0] != 0) {
                at[b] = extends(row, row - stages, i) ? plus(at[b], own[i - 1]) : combine(z[b], row, own, i, 1.0);
                Pair f = rates(p + b, at[b], wave[2 * i], wave[2 * i + 1]);
                rates_now[b] = (State){at[b].u, at[b].v, f.x, f.y};
            }
            State r = combine(rates_now[b], t.c + i * stages, own, i, per_h);
            if (t.gamma_sum[i] != 0) {
                r.u += t.gamma_sum[i] * h * slope[b].x;
                r.v += t.gamma_sum[i] * h * slope[b].y;
            }
            V u = r.u + a_q[b].xx * r.x + a_q[b].xy * r.y, v = r.v + a_q[b].yx * r.x + a_q[b].yy * r.y;
            own[i].u = inverse[b].xx * u + inverse[b].xy * v;
            own[i].v = inverse[b].yx * u + inverse[b].yy * v;
            own[i].x = per_shift * (r.x + own[i].u);
            own[i].y = per_shift * (r.y + own[i].v);
        }
#pragma GCC unroll 8
    for (int b = 0; b < BLOCK; b++)
        z[b] = extends(t.m, t.a + (stages - 1) * stages, stages) ? plus(at[b], k[b][stages - 1])
                                                                 : combine(z[b], t.m, k[b], stages, 1.0);
}

static const double RK4_ALPHA[4] = {0, 0.5, 0.5, 1};
#define RK4_STAGES 4

INLINE State moved(State z, double h, State rate) {
    return (State){z.x + h * rate.x, z.y + h * rate.y, z.u + h * rate.u, z.v + h * rate.v};
}

INLINE State derivative(const Constants *p, State z, const double *wave) {
    Pair f = rates(p, z, wave[0], wave[1]);
    return (State){z.u, z.v, f.x, f.y};
}

/* The classical explicit method of order four: what linear algebra buys, or does not, on these equations. */
INLINE void explicit_step(const Constants *p, State *z, double h, const double *wave) {
    State k[BLOCK], sum[BLOCK];
#pragma GCC unroll 8
    for (int i = 0; i < 4; i++)
#pragma GCC unroll 8
        for (int b = 0; b < BLOCK; b++) {
            State at = i == 0 ? z[b] : moved(z[b], h * RK4_ALPHA[i], k[b]);
            k[b] = derivative(p + b, at, wave + 2 * i);
            sum[b] = moved(i == 0 ? z[b] : sum[b], h * (i == 0 || i == 3 ? 1.0 / 6 : 1.0 / 3), k[b]);
        }
#pragma GCC unroll 8
    for (int b = 0; b < BLOCK; b++) z[b] = sum[b];
}

#define TABLEAU(METHOD)                                                                                                \
    (Tableau){METHOD##_GAMMA, METHOD##_ALPHA, METHOD##_GAMMA_SUM, METHOD##_M, &METHOD##_A[0][0], &METHOD##_C[0][0]}

#define ADVANCE(name, METHOD, STEP)                                                                                    \
    static __attribute__((noinline)) void name##_block(                                                               \
        const Constants *p, State *z, long revolutions, long steps, const double *waves) {                             \
        const double h = 2 * M_PI / steps;                                                                             \
        State now[BLOCK];                                                                                              \
        for (int b = 0; b < BLOCK; b++) now[b] = z[b];                                                                 \
        for (long r = 0; r < revolutions; r++)                                                                         \
            for (long i = 0; i < steps; i++) {                                                                         \
                const double *wave = waves + i * 2 * METHOD##_STAGES;                                                  \
                STEP;                                                                                                  \
            }                                                                                                          \
        for (int b = 0; b < BLOCK; b++) z[b] = now[b];                                                                 \
    }                                                                                                                  \
                                                                                                                       \
    /* Advance `lanes` states in place: constants as N_CONSTANTS columns, states as 4 columns. */                      \
    int name(long lanes, long revolutions, long steps, int threads, const double *constants, double *states) {         \
        double *waves = malloc(sizeof(double) * 2 * METHOD##_STAGES * steps);                                          \
        if (!waves || lanes % (WIDTH * BLOCK)) return 1;                                                               \
        for (long i = 0; i < steps * METHOD##_STAGES; i++) {                                                           \
            double tau = 2 * M_PI / steps * (i / METHOD##_STAGES + METHOD##_ALPHA[i % METHOD##_STAGES]);               \
            waves[2 * i] = cos(tau), waves[2 * i + 1] = sin(tau);                                                      \
        }                                                                                                              \
        _Pragma("omp parallel for schedule(dynamic, 1) num_threads(threads)")                                          \
        for (long first = 0; first < lanes; first += WIDTH * BLOCK) {                                                  \
            Constants p[BLOCK];                                                                                        \
            State z[BLOCK];                                                                                            \
            for (int b = 0; b < BLOCK; b++) {                                                                          \
                long from = first + b * WIDTH;                                                                         \
                for (unsigned long j = 0; j < N_CONSTANTS; j++)                                                        \
                    memcpy((V *)(p + b) + j, constants + j * lanes + from, sizeof(V));                                 \
                for (int j = 0; j < 4; j++) memcpy((V *)(z + b) + j, states + j * lanes + from, sizeof(V));            \
            }                                                                                                          \
            name##_block(p, z, revolutions, steps, waves);                                                             \
            for (int b = 0; b < BLOCK; b++)                                                                            \
                for (int j = 0; j < 4; j++)                                                                            \
                    memcpy(states + j * lanes + first + b * WIDTH, (V *)(z + b) + j, sizeof(V));                       \
        }                                                                                                              \
        free(waves);                                                                                                   \
        return 0;                                                                                                      \
    }

ADVANCE(rodas3, RODAS3, step(TABLEAU(RODAS3), RODAS3_STAGES, p, now, h, wave))
ADVANCE(rodas4, RODAS4, step(TABLEAU(RODAS4), RODAS4_STAGES, p, now, h, wave))
ADVANCE(rk4, RK4, explicit_step(p, now, h, wave))
