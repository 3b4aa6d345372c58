"""Edges followed to changed designs, beside a search there: `python -m benchmarks.following [--changes N] [--seed S]`.

Each change draws a speed at which the design has a stable synchronous orbit, and new values of six parameters within 20
per cent. The edges of the stable range around that speed are followed to the changed design, where `stable_range`
searches without hints but the speeds at which orbits are stable by the followed edges, since a stable range may move by
more than its width. An edge is

- `followed`, if the search finds it, too: the same kind at the same speed to 1e-5;
- `ended`, if following says why (`turned back`, `left the range`, `neutral saddle`), and no edge that the search finds
    leads back to it;
- `handed over`, if it was followed to a bifurcation of an unstable orbit: another edge bounds the range now;
- `missed`, if stable orbits end there by its multipliers, and it leads back to the edge from which it was followed: the
    search found another stable range, or none;
- a fault in any other case: it is lost, or is there and was not followed.
"""

import argparse
import pathlib
import tempfile
import time
from collections import Counter
from collections.abc import Iterator

import numpy as np

import jaxcage as jc
from jaxcage.files import read_bearing, write_template
from jaxcage.orbits import Followed, Point, Sensitivity, StableRange, follow, sensitivity, stable_range


CHANGE, SAME = 0.2, 1e-5
CHANGED = ("guidance_gap", "eccentricity", "land_width", "viscosity_1", "cage_mass", "amplitude")
DRAWN = (*CHANGED, "stiffness_x", "damping")
SPEEDS = 5000.0, 22000.0
"""Cage speeds [rpm] around which edges are followed."""
VERDICTS = "followed", "ended", "handed over", "missed", "fault"


def bearings(rng: np.random.Generator) -> Iterator[tuple[str, jc.CageModel]]:
    """The published cases, and two bearings of nobody: the template and a spindle with parameters drawn around them."""
    for name in ("1a", "1b", "2a", "2b", "3a", "3b"):
        yield name, jc.case(name)
    with tempfile.TemporaryDirectory() as folder:
        template = write_template(pathlib.Path(folder) / "template.toml")
        files = {"template": template, "spindle": pathlib.Path(__file__).with_name("spindle.toml")}
        for name, path in files.items():
            model = jc.replace(read_bearing(path).model, impact=jc.case("1a").impact)
            yield f"near {name}", changed(model, DRAWN, np.exp(rng.uniform(-0.4, 0.4, len(DRAWN))))


def changed(model: jc.CageModel, names: tuple[str, ...], factors: np.ndarray) -> jc.CageModel:
    """The design with parameters times factors."""
    now = jc.parameters(model)
    return jc.replace(model, **{n: float(now[n]) * float(f) for n, f in zip(names, factors, strict=True)})


def edges_of(found: StableRange | None) -> dict[str, Point]:
    """The edges of a stable range by name."""
    both = {} if found is None else {"lower": found.lower, "upper": found.upper}
    return {name: point for name, point in both.items() if point is not None}


def beside(followed: dict[str, Followed], otherwise: tuple[float, float]) -> tuple[float, float]:
    """Speeds [rad/s] at which orbits are stable by the followed edges, if there are any that bound a stable range."""
    at = {end: jc.rpm(f.edge.value_rpm) for end, f in followed.items() if f.edge is not None and f.edge.bounds}
    if not at:
        return otherwise
    low, high = at.get("lower", 0.99 * at.get("upper", 0.0)), at.get("upper", 1.01 * at.get("lower", 0.0))
    return (float(low), float(high)) if low < high else otherwise


def same(edge: Sensitivity, point: Point) -> bool:
    """Return True if both are the same bifurcation."""
    return edge.kind == point.kind and abs(edge.value_rpm / float(point.speed_rpm) - 1) < SAME


def verdict(
    models: tuple[jc.CageModel, jc.CageModel],
    point: Point,
    limits: tuple[float, float],
    fresh: dict[str, Point],
    found: Followed,
) -> str:
    """Say what became of an edge (see the head of this file)."""
    model, other = models

    def leads_back(reached: Point) -> bool:
        back = follow(other, reached, model, lower=limits[0], upper=limits[1]).edge
        return back is not None and same(back, point)

    if found.ended == "lost":
        return "fault"
    if (edge := found.edge) is None:
        return "fault" if any(leads_back(p) for p in fresh.values() if p.kind == point.kind) else "ended"
    if any(same(edge, p) for p in fresh.values()):
        return "followed"
    if not edge.bounds:
        return "handed over"
    assert edge.state is not None
    return "missed" if leads_back(Point(edge.kind, jc.rpm(edge.value_rpm), edge.state, steps=edge.steps)) else "fault"


def main() -> None:
    """Print a table, and each fault."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.following", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--changes", type=int, default=10, help="changes of each design")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", help="one of the designs by its name")
    given = parser.parse_args()
    jc.enable_x64()
    print(f"{'design':14}" + "".join(f"{v:>13}" for v in VERDICTS) + f"{'s per edge':>13}", flush=True)
    total, differs = Counter(), 0.0
    for number, (name, model) in enumerate(bearings(np.random.default_rng(given.seed))):
        if given.only not in (None, name):
            continue
        rng, count, spent, done = np.random.default_rng([given.seed, number]), Counter(), 0.0, 0
        while done < given.changes:
            speed, factors = jc.rpm(rng.uniform(*SPEEDS)), 1 + rng.uniform(-CHANGE, CHANGE, len(CHANGED))
            limits, other = (speed / 2, 2 * speed), changed(model, CHANGED, factors)
            before = stable_range(model, (0.99 * speed, 1.01 * speed), limits)
            if before is None or not edges_of(before):
                continue
            done += 1
            began = time.perf_counter()
            followed = {
                end: follow(model, point, other, lower=limits[0], upper=limits[1], name=end)
                for end, point in edges_of(before).items()
            }
            spent += time.perf_counter() - began
            fresh = edges_of(stable_range(other, beside(followed, before.ends), limits))
            for end, point in edges_of(before).items():
                found = followed[end]
                said = verdict((model, other), point, limits, fresh, found)
                count[said] += 1
                if said == "followed" and found.edge is not None:
                    edges = (sensitivity(other, p).value_rpm for p in fresh.values() if same(found.edge, p))
                    differs = max(differs, *(abs(e / found.edge.value_rpm - 1) for e in edges))
                elif said == "fault":
                    there = [f"{p.kind} at {float(p.speed_rpm):.3f}" for p in fresh.values()]
                    about = f"{end} {point.kind} at {float(point.speed_rpm):.3f}"
                    print(f"  {about}: {found.ended or found.edge} at share {found.share:.3f}; {there}")
                    print(f"    {name}, change {done}, factors {factors.round(4).tolist()}", flush=True)
        row = "".join(f"{count[v]:13d}" for v in VERDICTS) + f"{spent / max(count.total(), 1):13.2f}"
        print(f"{name:14}{row}", flush=True)
        total += count
    print(f"{'all':14}" + "".join(f"{total[v]:13d}" for v in VERDICTS))
    found = 100 * total["followed"] / max(total["followed"] + total["fault"], 1)
    print(f"{found:.1f} % of the edges that the search finds are followed, to {differs:.0e} of the speed")


if __name__ == "__main__":
    main()
