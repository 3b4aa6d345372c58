"""How many lanes a call should hold on this machine: `python -m benchmarks.chunks`.

Times a sweep with one exponent for several chunk sizes, after a run that compiles, and prints microseconds per
revolution and lane. The best sizes go into `jaxcage/sweeps/_engine.py`.
"""

import time

import jax


jax.config.update("jax_enable_x64", True)

import jaxcage as jc
from jaxcage.sweeps import _engine


LANES = 1024
REVOLUTIONS = 10


def main() -> None:
    """Print the table."""
    model, speeds = jc.case("1a", "preliminary"), jc.rpm(4000, 27500, LANES)
    for size in (32, 64, 128, 256, 512):
        _engine.CHUNKS = (size,)
        run = lambda: jc.sweep(
            model, speeds, starts=[(0.0, -2e-4, 0.0, 0.0)], discard=0, revolutions=REVOLUTIONS, blocks=1
        )
        run()
        times = []
        for _ in range(3):
            begin = time.perf_counter()
            run()
            times.append(time.perf_counter() - begin)
        print(f"{size:5d} lanes: {sorted(times)[1] / LANES / REVOLUTIONS * 1e6:7.1f} us", flush=True)


if __name__ == "__main__":
    main()
