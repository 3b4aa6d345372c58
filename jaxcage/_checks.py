"""Guards at the entry points: double precision on, and no version of JAX that is known to give wrong numbers."""

import jax


BAD_JAX = {
    "0.10.2": "https://github.com/jax-ml/jax/issues/39103",
    "0.11.0": "https://github.com/jax-ml/jax/issues/39257",
}


def require_x64() -> None:
    """Stop unless JAX computes in double precision and is of a version that computes correctly.

    **Raises:** `RuntimeError`, with the line that cures it.
    """
    if jax.__version__ in BAD_JAX:
        raise RuntimeError(
            f"JAX {jax.__version__} gives wrong results ({BAD_JAX[jax.__version__]}): install jax==0.10.1."
        )
    if not jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
        raise RuntimeError(
            'jaxcage needs double precision: call `jax.config.update("jax_enable_x64", True)` before using it.'
        )
