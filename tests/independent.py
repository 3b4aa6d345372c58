"""The cage equations written a second time, in plain NumPy: case 1a, rigid rib, polar formulas.

Nothing here comes from the package: neither formulas nor constants nor derivatives.
"""

import numpy as np
from scipy.integrate import solve_ivp


# NU2310 with a guidance gap of 0.45 mm, taken as the radial clearance; oil 56 mm^2/s at 870 kg/m^3.
CLEARANCE = 0.45e-3  # [m]
ECCENTRICITY = 23e-6  # [m]
MASS = 0.212227  # [kg]
RADIUS = (92.1e-3 - CLEARANCE) / 2  # [m]
WIDTH = 4.2679e-3  # [m]
VISCOSITY = 56e-6 * 870.0  # [Pa s]
FILM = 2 * VISCOSITY * RADIUS * WIDTH * (WIDTH / CLEARANCE) ** 2  # [N s], both lands
STIFFNESS = 37402.4  # [N/m]
CUBIC = 1.0732e13  # [N/m^3]
DAMPING = 3.3136  # [N s/m]
CROSS = -36.654  # [N/m], circulatory
AMPLITUDE, EXPONENT = 109.9051, 1.5091  # [N] at 1000 rad/s
ONSET = 0.97
CONTACT = 68992.2  # [N] at a penetration of one clearance
GRAVITY = 9.81  # [m/s^2]
ONSET_WIDTH = 2e-7 / CLEARANCE
CENTRE_WIDTH = 1e-9 / CLEARANCE


def ramp(u, width):
    """max(u, 0) with a slope that rises as 10 t^3 - 15 t^4 + 6 t^5 over [-width, width]."""
    t = np.clip((u + width) / (2 * width), 0.0, 1.0)
    inside = 2 * width * (2.5 * t**4 - 3 * t**5 + t**6)
    return np.where(u > width, u, inside)


def land_forces(x, y, u, v, omega):
    """Radial and tangential force [N] of film and contact; lengths in clearances."""
    eps = np.sqrt(x * x + y * y + CENTRE_WIDTH**2)
    eps_rate = (x * u + y * v) / eps
    sliding = omega * eps - 2 * (x * v - y * u) / eps  # (omega - 2 phi') eps
    excess = ramp(eps - ONSET, ONSET_WIDTH)
    kept = eps - excess  # the film's coefficients stay at their value at the onset of contact
    gap = 1 - kept * kept
    cross = kept / gap**2
    radial = -FILM * (sliding * cross + np.pi / 2 * (1 + 2 * kept * kept) / (gap**2 * np.sqrt(gap)) * eps_rate)
    tangential = FILM * (sliding * np.pi / (4 * gap * np.sqrt(gap)) + 2 * cross * eps_rate)
    pressed = np.zeros_like(excess)
    np.power(excess, 10 / 9, out=pressed, where=excess > 0)
    return radial - CONTACT * pressed, tangential, eps


def rates(tau, state, omega):
    """dy/dtau for states (x, y, x', y') in SI units, along the first axis."""
    x, y, u, v = state
    c = CLEARANCE
    radial, tangential, eps = land_forces(x / c, y / c, u / c, v / c, omega)
    cos, sin = x / (c * eps), y / (c * eps)
    spring = STIFFNESS + CUBIC * (x * x + y * y)
    turning = MASS * ECCENTRICITY * omega**2
    impact = AMPLITUDE * (omega / 1000.0) ** EXPONENT
    f_x = radial * cos - tangential * sin - spring * x - CROSS * y - DAMPING * u
    f_y = radial * sin + tangential * cos - spring * y + CROSS * x - DAMPING * v
    f_x = f_x + turning * np.cos(tau) + impact * np.sin(tau)
    f_y = f_y + turning * np.sin(tau) - MASS * GRAVITY
    return np.stack([u, v, f_x / MASS, f_y / MASS]) / omega


def scale(omega):
    """Magnitude of each state component, along the first axis."""
    length = CLEARANCE * np.ones_like(omega)
    return np.stack([length, length, CLEARANCE * omega, CLEARANCE * omega])


def strobe(state, omega, method="LSODA"):
    """One revolution by SciPy."""
    unit = scale(omega)
    solution = solve_ivp(
        lambda tau, z: rates(tau, z * unit, omega) / unit,
        (0.0, 2 * np.pi),
        np.asarray(state) / unit,
        method=method,
        rtol=1e-11,
        atol=1e-12,
    )
    assert solution.success, solution.message
    return solution.y[:, -1] * unit


def periodic_orbit(state, omega, method="LSODA", iterations=4):
    """Newton on the strobe map, its Jacobian from differences.

    **Returns:** strobe state of the period-1 orbit, and the last correction in units of `scale`.
    """
    unit, h = scale(omega), 1e-5
    z = np.asarray(state) / unit
    correction = np.inf
    for _ in range(iterations):
        image = strobe(z * unit, omega, method) / unit
        columns = [(strobe((z + h * e) * unit, omega, method) / unit - image) / h for e in np.eye(4)]
        step = np.linalg.solve(np.stack(columns, axis=1) - np.eye(4), z - image)
        z = z + step
        correction = np.abs(step).max()
        if correction < 1e-9:
            break
    return z * unit, correction


def tangent_rates(tau, state, tangent, omega, unit, h=1e-6):
    """dy/dtau and the variational equation, with the Jacobian along `tangent` from differences."""
    shift = h * tangent * unit
    lanes = state.shape[1]
    stacked = np.concatenate([state, state + shift, state - shift], axis=1)
    f = rates(tau, stacked, np.tile(omega, 3))
    middle, ahead, behind = f[:, :lanes], f[:, lanes : 2 * lanes], f[:, 2 * lanes :]
    return middle, (ahead - behind) / (2 * h * unit)


def lyapunov_exponents(state, omega, discard, revolutions, steps=256, seed=0):
    """Mean growth per revolution of a tangent vector in every lane, by RK4 on state and tangent.

    **Arguments:** states of shape (4, lanes), speeds of shape (lanes,), revolutions that align the
    tangent vectors, revolutions that are counted, steps per revolution.

    **Returns:** exponent of each lane, shape (lanes,).
    """
    unit = scale(omega)
    w = np.random.default_rng(seed).normal(size=state.shape)
    w = w / np.linalg.norm(w, axis=0)
    total = np.zeros(state.shape[1])
    h = 2 * np.pi / steps
    for n in range(discard + revolutions):
        for i in range(steps):
            tau = i * h
            a, p = tangent_rates(tau, state, w, omega, unit)
            b, q = tangent_rates(tau + h / 2, state + h / 2 * a, w + h / 2 * p, omega, unit)
            c, r = tangent_rates(tau + h / 2, state + h / 2 * b, w + h / 2 * q, omega, unit)
            d, s = tangent_rates(tau + h, state + h * c, w + h * r, omega, unit)
            state = state + h / 6 * (a + 2 * b + 2 * c + d)
            w = w + h / 6 * (p + 2 * q + 2 * r + s)
        size = np.linalg.norm(w, axis=0)
        w = w / size
        if n >= discard:
            total += np.log(size)
    return total / revolutions
