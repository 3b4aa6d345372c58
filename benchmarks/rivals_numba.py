"""Equal steps by numba: scalar code, one lane after the other, lanes shared among the cores."""

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np

from .problem import Problem, constants
from .tableaux import RODAS4


class Numba:
    """Rodas4 with 2 by 2 elimination or the classical Runge-Kutta method, `njit(parallel=True, fastmath=True)`."""

    lanes, revolutions, tight, agree = 2048, 10, 8192, 1e-7

    def __init__(self, method: str, settings: tuple[int, ...]):
        self.name, self.method, self.settings = f"numba, {method}", method, settings

    def missing(self) -> str | None:
        return None if importlib.util.find_spec("numba") else "no numba"

    def prepare(self, cores: int) -> None:
        import numba  # pyright: ignore[reportMissingImports]

        alpha, step = rodas4_step() if self.method == "rodas4" else rk4_step()
        self.program = make_program(alpha, step)
        self.program(np.zeros((1, 4)), np.ones((1, 14)), 1, 1)
        numba.set_num_threads(cores)

    def close(self) -> None:
        pass

    def on(self, problem: Problem) -> Callable[[int, int], np.ndarray]:
        numbers, scale = constants(problem.model, problem.speeds), problem.scale
        start = problem.states / scale
        return lambda revolutions, steps: self.program(start, numbers, revolutions, steps) * scale


def rodas4_step() -> tuple[np.ndarray, Any]:
    """Phases of the stages, and one step: (state, constants, step size, cosines and sines, work space) -> state."""
    import numba  # pyright: ignore[reportMissingImports]

    from .cage_numba import FAST, acceleration, jacobian

    gamma, alpha, gamma_sum, a, c, m = RODAS4
    stages = alpha.size
    fresh = np.any(a != 0, axis=1)  # stages that evaluate the field anew

    @numba.njit(**FAST)
    def step(z, p, h, wave, k):
        x, y, u, v = z
        qxx, qxy, qyx, qyy, vxx, vxy, vyx, vyy = jacobian(p, x, y, u, v)
        shift, per_shift, per_h = 1 / (gamma * h), gamma * h, 1 / h
        qxx, qxy, qyx, qyy = per_shift * qxx, per_shift * qxy, per_shift * qyx, per_shift * qyy
        ixx, ixy, iyx, iyy = shift - vxx - qxx, -vxy - qxy, -vyx - qyx, shift - vyy - qyy
        per_det = 1 / (ixx * iyy - ixy * iyx)
        turn_x, turn_y = p[12] * wave[0, 0] - p[11] * wave[0, 1], p[11] * wave[0, 0]
        fx, fy = acceleration(wave[0, 0], wave[0, 1], p, x, y, u, v)
        fu, fv = u, v
        for i in range(stages):
            if fresh[i]:
                ax, ay, au, av = x, y, u, v
                for j in range(i):
                    w = a[i, j]
                    ax, ay, au, av = ax + w * k[j, 0], ay + w * k[j, 1], au + w * k[j, 2], av + w * k[j, 3]
                fx, fy = acceleration(wave[i, 0], wave[i, 1], p, ax, ay, au, av)
                fu, fv = au, av
            rx, ry, ru, rv = fu, fv, fx + gamma_sum[i] * h * turn_x, fy + gamma_sum[i] * h * turn_y
            for j in range(i):
                w = per_h * c[i, j]
                rx, ry, ru, rv = rx + w * k[j, 0], ry + w * k[j, 1], ru + w * k[j, 2], rv + w * k[j, 3]
            bu, bv = ru + qxx * rx + qxy * ry, rv + qyx * rx + qyy * ry
            ku, kv = (iyy * bu - ixy * bv) * per_det, (ixx * bv - iyx * bu) * per_det
            k[i, 0], k[i, 1], k[i, 2], k[i, 3] = per_shift * (rx + ku), per_shift * (ry + kv), ku, kv
        for j in range(stages):
            w = m[j]
            x, y, u, v = x + w * k[j, 0], y + w * k[j, 1], u + w * k[j, 2], v + w * k[j, 3]
        return x, y, u, v

    return alpha, step


def rk4_step() -> tuple[np.ndarray, Any]:
    """The same of the classical Runge-Kutta method."""
    import numba  # pyright: ignore[reportMissingImports]

    from .cage_numba import FAST, acceleration

    alpha = np.array([0.0, 0.5, 0.5, 1.0])
    weight = np.array([1.0, 2.0, 2.0, 1.0]) / 6

    @numba.njit(**FAST)
    def step(z, p, h, wave, k):
        x, y, u, v = z
        ku = kv = kx = ky = 0.0
        dx, dy, du, dv = x, y, u, v
        for i in range(4):
            a, b = h * alpha[i], h * weight[i]
            ax, ay, au, av = x + a * kx, y + a * ky, u + a * ku, v + a * kv
            kx, ky = au, av
            ku, kv = acceleration(wave[i, 0], wave[i, 1], p, ax, ay, au, av)
            dx, dy, du, dv = dx + b * kx, dy + b * ky, du + b * ku, dv + b * kv
        return dx, dy, du, dv

    return alpha, step


def make_program(alpha: np.ndarray, step: Any) -> Any:
    """states, constants, revolutions, steps -> states."""
    import numba  # pyright: ignore[reportMissingImports]

    from .cage_numba import FAST

    stages = alpha.size

    @numba.njit(parallel=True, **FAST)
    def program(states, numbers, revolutions, steps):
        h = 2 * np.pi / steps
        waves = np.empty((steps, stages, 2))
        for n in range(steps):
            for i in range(stages):
                waves[n, i, 0], waves[n, i, 1] = np.cos(h * (n + alpha[i])), np.sin(h * (n + alpha[i]))
        out = np.empty_like(states)
        for lane in numba.prange(states.shape[0]):
            k = np.empty((stages, 4))
            z = (states[lane, 0], states[lane, 1], states[lane, 2], states[lane, 3])
            for n in range(revolutions * steps):
                z = step(z, numbers[lane], h, waves[n % steps], k)
            out[lane, 0], out[lane, 1], out[lane, 2], out[lane, 3] = z
        return out

    return program
