"""Compiler settings for XLA on CPUs, chosen by measurement.

XLA's CPU backend computes every output of a fused loop by itself unless multi-output fusion is on: an integration
step, which has several outputs that share nearly all of their arithmetic, then does it over and over. Measured on one
revolution of the cage (128 steps of Rodas3): 5345 multiplications compiled instead of 586, 3.4 times the run time. The
setting is read when JAX compiles for the first time in a process, so it must be made before that.
"""

import os


FLAG = "--xla_backend_extra_options=xla_cpu_use_multi_output_fusion"


def configure() -> bool:
    """Turn on multi-output fusion for this process; call before JAX compiles anything.

    Leaves everything alone if the user has given `xla_backend_extra_options` in XLA_FLAGS, or set JAXCAGE_XLA=0.

    **Returns:** whether the setting is in XLA_FLAGS now.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    if FLAG in flags:
        return True
    if "xla_backend_extra_options" in flags or os.environ.get("JAXCAGE_XLA") == "0":
        return False
    os.environ["XLA_FLAGS"] = f"{flags} {FLAG}".strip()
    return True
