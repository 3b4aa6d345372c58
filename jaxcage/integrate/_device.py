"""A march as one kernel on a GPU: the loop over its steps runs inside, in registers.

The same scalar step as on a CPU, applied to blocks of lanes by Pallas (Triton). In interpret mode the kernel runs
anywhere, slowly: that is how it is tested without a GPU.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Int


BLOCK = 128
"""Lanes of a block: four warps of a GPU."""


def march_on_device(
    step: Callable[..., Sequence[Any]],
    moved: int,
    needed: Sequence[int],
    count: Int[Array, ""],
    numbers: Sequence[Array],
    interpret: bool = False,
) -> tuple[Array, ...]:
    """`count` steps in every lane.

    **Arguments:** the step as a function (number of the step, numbers) -> the first `moved` of the numbers; which of
    the other numbers it uses; how many steps; numbers, each a scalar or an array of lanes, all of one shape.

    **Returns:** the moved arrays.
    """
    from jax.experimental import pallas as pl  # not on every platform
    from jax.experimental.pallas import triton

    shape = max((x.shape for x in numbers), key=len)
    lanes = math.prod(shape)
    blocks = -(-lanes // BLOCK)
    spread = lambda x: jnp.pad(jnp.broadcast_to(x, shape).reshape(lanes), (0, blocks * BLOCK - lanes), mode="edge")
    row = list(map(spread, numbers[:moved]))
    own = {i: spread(numbers[i]) for i in needed if numbers[i].shape}
    alike = [i for i in needed if not numbers[i].shape]
    width = max(2, 1 << max(len(alike) - 1, 0).bit_length())  # array sizes are powers of two
    shared = jnp.pad(jnp.stack([jnp.zeros(()), *(numbers[i] for i in alike)])[1:], (0, width - len(alike)))
    steps = jnp.full((2,), count, jnp.int32)

    def kernel(*refs) -> None:  # pyright: ignore[reportMissingParameterType]
        shared_ref, steps_ref = refs[:2]
        given, results = refs[2 : 2 + moved + len(own)], refs[2 + moved + len(own) :]
        same = {i: shared_ref[k] for k, i in enumerate(alike)}
        rest = tuple(ref[...] for ref in given[moved:])

        def one(i: Array, *lane: Array) -> Sequence[Any]:
            known = same | dict(zip(own, lane[moved:], strict=True))
            return step(i, *lane[:moved], *(known.get(k, 0.0) for k in range(moved, len(numbers))))

        def body(i: Array, carry: tuple[Array, ...]) -> tuple[Array, ...]:
            return tuple(jax.vmap(lambda *lane: one(i.astype(float), *lane))(*carry, *rest))

        after = jax.lax.fori_loop(0, steps_ref[0], body, tuple(ref[...] for ref in given[:moved]))
        for ref, x in zip(results, after, strict=True):
            ref[...] = x

    lane, whole = pl.BlockSpec((BLOCK,), lambda i: (i,)), lambda n: pl.BlockSpec((n,), lambda i: (0,))
    call = pl.pallas_call(
        kernel,
        out_shape=[jax.ShapeDtypeStruct((blocks * BLOCK,), float)] * moved,
        grid=(blocks,),
        in_specs=[whole(width), whole(2), *[lane] * (moved + len(own))],
        out_specs=[lane] * moved,
        compiler_params=triton.CompilerParams(num_warps=BLOCK // 32),
        interpret=interpret,
    )
    after = call(shared, steps, *row, *own.values())
    return tuple(x[:lanes].reshape(shape) for x in after)
