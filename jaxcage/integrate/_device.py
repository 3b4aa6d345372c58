"""A revolution as one kernel on a GPU: the loop over its steps runs inside, in registers.

The same scalar step as on a CPU, applied to blocks of lanes by Pallas (Triton). A block whose lanes do not ask for the
rung leaves at once. In interpret mode the kernel runs anywhere, slowly: that is how it is tested without a GPU.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Int

from .._types import Scalar
from ._lanewise import ScalarFunction


BLOCK = 128
"""Lanes of a block: four warps of a GPU."""


def steps_on_device(
    step: ScalarFunction,
    shared: Sequence[Scalar],
    row: Sequence[Array],
    own: Sequence[Array],
    h: Scalar,
    count: Int[Array, ""] | int,
    mine: Bool[Array, " lanes"],
    interpret: bool = False,
) -> tuple[Array, ...]:
    """`count` steps of size h from phase 0 in the blocks in which any lane is `mine`; the others stay as they are.

    **Arguments:** step, as `lanewise` takes it, with (phase, step, shared numbers); shared numbers; what the step moves
    and what it only reads, each an array of lanes; step size; number of steps; lanes that need them.

    **Returns:** the moved arrays.
    """
    from jax.experimental import pallas as pl  # not on every platform
    from jax.experimental.pallas import triton

    lanes = row[0].shape[0]
    blocks = -(-lanes // BLOCK)
    filled = lambda x: jnp.pad(x, (0, blocks * BLOCK - lanes), mode="edge")
    width = max(2, 1 << (len(shared)).bit_length())  # array sizes are powers of two
    numbers = jnp.stack([jnp.asarray(h, float), *(jnp.asarray(s, float) for s in shared)])
    numbers = jnp.pad(numbers, (0, width - numbers.size))
    steps = jnp.full((2,), count, jnp.int32)
    moved, fixed = len(row), len(own)

    def kernel(*refs) -> None:  # pyright: ignore[reportMissingParameterType]
        numbers_ref, steps_ref, mine_ref = refs[:3]
        given, results = refs[3 : 3 + moved + fixed], refs[3 + moved + fixed :]
        size = numbers_ref[0]
        alike = tuple(numbers_ref[1 + i] for i in range(len(shared)))
        rest = tuple(ref[...] for ref in given[moved:])
        asked = jnp.max(mine_ref[...]) > 0
        last = jnp.where(asked, steps_ref[0], 0)

        def body(i: Array, carry: tuple[Array, ...]) -> tuple[Array, ...]:
            now = (i.astype(float) * size, size, *alike)
            return jax.vmap(lambda *lane: step(now, lane))(*carry, *rest)

        after = jax.lax.fori_loop(0, last, body, tuple(ref[...] for ref in given[:moved]))
        for ref, x in zip(results, after, strict=True):
            ref[...] = x

    lane, whole = pl.BlockSpec((BLOCK,), lambda i: (i,)), lambda n: pl.BlockSpec((n,), lambda i: (0,))
    call = pl.pallas_call(
        kernel,
        out_shape=[jax.ShapeDtypeStruct((blocks * BLOCK,), float)] * moved,
        grid=(blocks,),
        in_specs=[whole(width), whole(2), *[lane] * (1 + moved + fixed)],
        out_specs=[lane] * moved,
        compiler_params=triton.CompilerParams(num_warps=BLOCK // 32),
        interpret=interpret,
    )
    after = call(numbers, steps, filled(mine.astype(jnp.int32)), *map(filled, row), *map(filled, own))
    return tuple(x[:lanes] for x in after)
