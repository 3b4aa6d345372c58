"""Tridiagonal systems around a ring, of numbers or of blocks.

A film discretised around the rib couples each station with its two neighbours and the last with the first. Of numbers,
it is LAPACK's tridiagonal solve (through jax.lax, which knows its derivatives) with the two corners put in by
Sherman and Morrison. Of blocks, for which no library has a solver, it is cyclic reduction: every second station is
eliminated at once, which leaves a ring of half as many stations of the same form. No pivoting between stations: the
film's systems are diagonally dominant in blocks.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


Blocks = Float[Array, "stations k k"]
Columns = Float[Array, "stations k m"]


def solve_ring(lower: Blocks, middle: Blocks, upper: Blocks, right: Columns) -> Columns:
    """x with lower[i] x[i-1] + middle[i] x[i] + upper[i] x[i+1] = right[i], indices modulo the number of stations.

    **Arguments:** blocks of the matrix, right-hand sides in the last axis. With blocks of more than one number, station
    numbers 2^j times a small odd number are cheap: the odd rest is solved as one dense system.
    """
    if middle.shape[-1] == 1:
        return _numbers(lower[:, 0, 0], middle[:, 0, 0], upper[:, 0, 0], right[:, 0, :])[:, None, :]
    return _blocks(lower, middle, upper, right)


def _numbers(lower: Array, middle: Array, upper: Array, right: Array) -> Array:
    corner = jnp.zeros_like(middle).at[0].set(-middle[0]).at[-1].set(upper[-1])
    share = lower[0] / -middle[0]
    open_ = middle.at[0].add(middle[0]).at[-1].add(-upper[-1] * share)
    columns = jnp.concatenate([right, corner[:, None]], axis=1)
    solved = jax.lax.linalg.tridiagonal_solve(lower.at[0].set(0.0), open_, upper.at[-1].set(0.0), columns)
    x, around = solved[:, :-1], solved[:, -1]
    closed = (x[0] + share * x[-1]) / (1 + around[0] + share * around[-1])  # what the corners add
    return x - jnp.outer(around, closed)


def _blocks(lower: Blocks, middle: Blocks, upper: Blocks, right: Columns) -> Columns:
    n, k, m = right.shape
    if n % 2:
        rows = []
        for i in range(n):
            row = jnp.zeros((n, k, k), right.dtype).at[i].add(middle[i])
            rows.append(row.at[(i - 1) % n].add(lower[i]).at[(i + 1) % n].add(upper[i]))
        dense = jnp.stack(rows).transpose(0, 2, 1, 3).reshape(n * k, n * k)
        return jnp.linalg.solve(dense, right.reshape(n * k, m)).reshape(n, k, m)
    odd = jnp.concatenate([lower[1::2], upper[1::2], right[1::2]], axis=-1)
    after = jnp.linalg.solve(middle[1::2], odd)  # an odd station, given those after and before it
    before = jnp.roll(after, 1, axis=0)
    down, up = lower[0::2], upper[0::2]
    reduced = _blocks(
        -down @ before[..., :k],
        middle[0::2] - down @ before[..., k : 2 * k] - up @ after[..., :k],
        -up @ after[..., k : 2 * k],
        right[0::2] - down @ before[..., 2 * k :] - up @ after[..., 2 * k :],
    )
    between = after[..., 2 * k :] - after[..., :k] @ reduced - after[..., k : 2 * k] @ jnp.roll(reduced, -1, axis=0)
    return jnp.stack([reduced, between], axis=1).reshape(n, k, m)
