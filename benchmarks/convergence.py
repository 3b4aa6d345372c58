"""Which solver and how many steps per revolution: `python -m benchmarks.convergence [--quick]`.

Two tables, printed and written to `benchmarks/convergence.md`:

1. Error of the one-revolution map against a tight reference, over states sampled from the attractors of a case, in
   clearances (the largest of the two coordinates): median and 99th percentile.
2. What the step count does to the picture: the chaotic zones of the case for each method.
"""

import argparse
import pathlib
from importlib.metadata import version

import jax
import numpy as np


jax.config.update("jax_enable_x64", True)

import jaxcage as jc


CASE = "1a"
REFERENCE = jc.method("rodas4", steps=8192)
METHODS = [
    *(("rodas3", n) for n in (64, 128, 256, 512, 1024)),
    *(("rodas4", n) for n in (64, 96, 128, 192, 256, 512)),
    *(("rk4", n) for n in (64, 96, 128, 192, 256, 384, 512, 768, 1024, 2048)),
    ("controlled", 0),
    *(("newmark", n) for n in (128, 512, 2048)),
]
PICTURES = [
    ("rodas3", 64),
    ("rodas3", 128),
    ("rodas3", 256),
    ("rodas3", 1024),
    ("rodas4", 64),
    ("rodas4", 128),
    ("rodas4", 256),
    ("rk4", 1024),
    ("controlled", 0),
]


def make(solver: str, steps: int) -> jc.integrate.AbstractMethod:
    """A method of the tables; `controlled` is the default of sweeps, which chooses its steps."""
    return jc.controlled() if solver == "controlled" else jc.method(solver, steps=steps)


def attractor_states(model: jc.CageModel, speeds: np.ndarray) -> np.ndarray:
    """States on the attractors: the end of a run from each start, shape (speeds, starts, 4)."""
    return jc.sweep(model, speeds, discard=200, revolutions=16, blocks=1, exponents=0, keep=16).last


def one_revolution(
    model: jc.CageModel, speeds: np.ndarray, states: np.ndarray, method: jc.integrate.AbstractMethod
) -> np.ndarray:
    """The strobe map of every state, shape (speeds, starts, 4)."""
    return jc.sweep(model, speeds, starts=states, method=method, discard=0, revolutions=1, blocks=1, exponents=0).last


def errors(model: jc.CageModel, speeds: np.ndarray, states: np.ndarray, quick: bool) -> list[list[str]]:
    """Rows of table 1."""
    truth = one_revolution(model, speeds, states, REFERENCE)
    scale = np.asarray(model.clearance)
    rows = []
    for solver, steps in METHODS[:: 3 if quick else 1]:
        method = make(solver, steps)
        got = one_revolution(model, speeds, states, method)
        apart = np.max(np.abs(got - truth)[..., :2], axis=-1).ravel() / scale
        apart = np.where(np.isfinite(apart), apart, np.inf)
        median, most = np.quantile(apart, [0.5, 0.99], method="higher")
        rows.append([solver, str(steps), f"{median:.1e}", f"{most:.1e}"])
        print(*rows[-1], flush=True)
    return rows


def pictures(model: jc.CageModel, speeds: np.ndarray, quick: bool) -> list[list[str]]:
    """Rows of table 2."""
    rows = []
    for solver, steps in PICTURES[:: 3 if quick else 1]:
        got = jc.sweep(model, speeds, method=make(solver, steps))
        found = jc.zones(got)
        spans = [f"{z.onset or 'below'} to {z.exit or 'above'}" for z in found.zones if (z.width_rpm or 1e9) >= 500]
        failed = int(np.sum(got.failed))
        rows.append([solver, str(steps), str(failed), "; ".join(spans).replace(" rpm", "")])
        print(*rows[-1], flush=True)
    return rows


def table(head: list[str], rows: list[list[str]]) -> str:
    """Markdown table."""
    line = lambda cells: "| " + " | ".join(cells) + " |"
    return "\n".join([line(head), line(["---"] * len(head)), *map(line, rows)])


def main() -> None:
    """Run the study and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few methods, few speeds, nothing written")
    quick = parser.parse_args().quick
    model = jc.case(CASE, "preliminary")
    speeds = jc.rpm(4000, 27500, 12 if quick else 95)
    states = attractor_states(model, speeds)
    first = table(
        ["solver", "steps", "median error / c", "99 % error / c"],
        errors(model, speeds, states, quick),
    )
    second = table(
        ["solver", "steps", "failed lanes", "chaotic zones at least 500 rpm wide, rpm"], pictures(model, speeds, quick)
    )
    page = (
        f"# Convergence study\n\nMade by `python -m benchmarks.convergence`, case {CASE}, {states[..., 0].size} "
        f"states on the attractors from {speeds.size} speeds, jax {version('jax')}. Reference: Rodas4, 8192 steps.\n\n"
        f"## Error of the one-revolution map\n\n{first}\n\n## Zones\n\nGrid of "
        f"{np.diff(speeds)[0] * 30 / np.pi:.0f} rpm, 3 starts, 300 + 300 revolutions.\n\n{second}\n"
    )
    print(page)
    if not quick:
        pathlib.Path(__file__).with_name("convergence.md").write_text(page)


if __name__ == "__main__":
    main()
