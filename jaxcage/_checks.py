"""Guards at the entry points: double precision on, and no version of JAX that is known to give wrong numbers."""

import warnings

import jax


BAD_JAX = {
    "0.10.2": "https://github.com/jax-ml/jax/issues/39103",
    "0.11.0": "https://github.com/jax-ml/jax/issues/39257",
}


def _wrong_results() -> str:
    """What to say of this JAX; empty if it is fine."""
    issue = BAD_JAX.get(jax.__version__)
    return f"JAX {jax.__version__} gives wrong results ({issue}): install jax==0.10.1." if issue else ""


if jax.__version__ in BAD_JAX:
    warnings.warn(_wrong_results(), RuntimeWarning, stacklevel=2)


def enable_x64() -> None:
    """Make JAX compute in double precision, for the whole process: a script's first line after `import jaxcage`."""
    jax.config.update("jax_enable_x64", True)


def require_x64() -> None:
    """Stop unless JAX computes in double precision and is of a version that computes correctly.

    **Raises:** `RuntimeError`, with the line that cures it.
    """
    if said := _wrong_results():
        raise RuntimeError(said)
    if not jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
        raise RuntimeError("jaxcage needs double precision: call `jaxcage.enable_x64()` before using it.")
