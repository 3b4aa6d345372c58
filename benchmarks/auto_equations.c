/* A forced system for AUTO-07p: the phase is carried along as the limit cycle (cos, sin) of an oscillator.

   LAW is the file with the system's `rates`; par[0] is the speed over that at which the branch begins. */
#include "auto_f2c.h"
#include LAW

int func(integer ndim, const doublereal *u, const integer *icp, const doublereal *par, integer ijac, doublereal *f,
         doublereal *dfdu, doublereal *dfdp) {
    const double *pair = u + ndim - 2, rest = 1 - pair[0] * pair[0] - pair[1] * pair[1];
    rates(par[0], pair[0], pair[1], u, f);
    f[ndim - 2] = pair[0] * rest - pair[1];
    f[ndim - 1] = pair[1] * rest + pair[0];
    return 0;
}

int stpnt(integer ndim, doublereal t, doublereal *u, doublereal *par) {
    par[0] = 1;
    return 0;
}

int bcnd(integer ndim, const doublereal *par, const integer *icp, integer nbc, const doublereal *u0,
         const doublereal *u1, integer ijac, doublereal *fb, doublereal *dbc) {
    return 0;
}

int icnd(integer ndim, const doublereal *par, const integer *icp, integer nint, const doublereal *u,
         const doublereal *uold, const doublereal *udot, const doublereal *upold, integer ijac, doublereal *fi,
         doublereal *dint) {
    return 0;
}

int fopt(integer ndim, const doublereal *u, const integer *icp, const doublereal *par, integer ijac, doublereal *fs,
         doublereal *dfdu, doublereal *dfdp) {
    return 0;
}

int pvls(integer ndim, const doublereal *u, doublereal *par) { return 0; }
