"""The sweep of case 1a on a GPU and on the CPU of the same machine: `python -m benchmarks.gpu [--speeds 5461]`.

Prints the revolutions per second and lane, with the largest exponent, on the default device of JAX if that is a GPU,
and in a process of its own on the CPU. Where JAX finds no GPU, it says so and measures nothing.
"""

import argparse
import os
import subprocess
import sys

import jax

import jaxcage as jc

from .worker import quickest


STARTS, REVOLUTIONS = 3, 20


def rate(speeds: int) -> float:
    """Revolutions per second and lane on the default device, after a run that compiles."""
    model, grid = jc.case("1a"), jc.rpm(2500, 27500, speeds)
    run = lambda: (
        jc.sweep(model, grid, discard=0, revolutions=REVOLUTIONS, blocks=1, confirm=False, horizon=0).exponents
    )
    run()
    return REVOLUTIONS / quickest(run)


def main() -> None:
    """Measure on both."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gpu", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--speeds", type=int, default=5461, help=f"each from {STARTS} starts")
    parser.add_argument("--cpu", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    jc.enable_x64()
    if given.cpu:
        print(rate(given.speeds))
    elif jax.default_backend() != "gpu":
        print(f"No GPU was found: the default device of JAX is {jax.devices()[0].device_kind}.")
    else:
        lanes, found = given.speeds * STARTS, {jax.devices()[0].device_kind: rate(given.speeds)}
        command = [sys.executable, "-m", "benchmarks.gpu", "--cpu", "--speeds", str(given.speeds)]
        environment = {**os.environ, "JAX_PLATFORMS": "cpu"}
        done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
        found["CPU"] = float(done.stdout.splitlines()[-1])
        for name, each in found.items():
            print(
                f"{name}: {each:.3g} revolutions per second and lane, {lanes} lanes, {each * lanes:.3g} a second in all"
            )


if __name__ == "__main__":
    main()
