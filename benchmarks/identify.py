"""Planted constants of the cage, found again from 24 noisy edges: how often the 95 % intervals hold the truth.

    python -m benchmarks.identify [--draws 20]

Zone 1 of case 1a begins and ends with a period doubling. Both are followed to twelve cages that differ in guidance gap
and eccentricity, as a test rig would have them, and measured there with 1 % noise. Six constants are sought; the cage
is weighed, and the contact, the oil and gravity are known. Of every unknown a guess is known beforehand, wrong by 20 %
(one standard deviation, drawn anew each time). Every draw starts at the truth: what is tested is the least-squares fit
and its intervals, not the search for the valley (`jaxcage.design.screen`).
"""

import argparse
import dataclasses
import time

import numpy as np

import jaxcage as jc


jc.enable_x64()


UNKNOWNS = {
    "stiffness": ("stiffness_x", "stiffness_y"),
    "cubic_stiffness": (),
    "damping": (),
    "land_width": (),
    "amplitude": (),
    "exponent": (),
}
NOISE, GUESS = 0.01, 0.2
"""Relative standard deviations of the measured edges, and of what is known of the constants beforehand."""
DESIGNS = [(gap * 1e-3, e * 1e-6) for gap in (0.43, 0.45, 0.47) for e in (19, 22, 25, 28)]
"""Guidance gap and eccentricity of each cage [m]."""
EDGES = {"zone 1 onset": (8000, 9000), "zone 1 exit": (12000, 13000)}
"""Speeds [rpm] between which case 1a has the period doubling in question."""
SUBSTEPS = 8


def planted(model: jc.CageModel) -> tuple[list[jc.design.Unknown], dict[str, float]]:
    """The unknowns, within a factor of four of the truth, and the truth."""
    known = jc.parameters(model)
    truth = {name: float(known[(sets or (name,))[0]]) for name, sets in UNKNOWNS.items()}
    return [jc.design.Unknown(n, v / 4, v * 4, sets=UNKNOWNS[n]) for n, v in truth.items()], truth


def followed(model: jc.CageModel, low: float, high: float) -> dict[tuple[float, float], jc.orbits.Sensitivity]:
    """The period doubling of case 1a between two speeds [rpm] in every design, each from the nearest that is known."""
    orbits = jc.synchronous_orbits(model, float(jc.rpm(low)), float(jc.rpm(high)), count=21, discard=1500)
    first = next(p for p in orbits.edges if p.kind == "period-doubling")
    here = (float(model.guidance_gap), float(model.eccentricity))
    found = {here: jc.sensitivity(model, first)}
    for design in sorted(DESIGNS, key=lambda d: abs(d[0] / here[0] - 1) + abs(d[1] / here[1] - 1)):
        near = min(found, key=lambda d: abs(d[0] / design[0] - 1) + abs(d[1] / design[1] - 1))
        last = found[near]
        for share in np.linspace(0, 1, SUBSTEPS + 1)[1:]:
            gap, e = (a + share * (b - a) for a, b in zip(near, design))
            assert last.state is not None, f"the period doubling ends before {design}"
            steps = {"guidance_gap": (design[0] - near[0]) / SUBSTEPS, "eccentricity": (design[1] - near[1]) / SUBSTEPS}
            rpm = last.value_rpm + sum(last.derivative[n] * d for n, d in steps.items())
            guess = jc.orbits.Point("period-doubling", float(jc.rpm(rpm)), last.state)
            last = jc.sensitivity(jc.replace(model, guidance_gap=gap, eccentricity=e), guess)
        found[design] = last
    return {design: found[design] for design in DESIGNS}


def main() -> None:
    """Fit every draw and print the table."""
    parser = argparse.ArgumentParser(description="Coverage of the identification's intervals on the cage.")
    parser.add_argument("--draws", type=int, default=20)
    options = parser.parse_args()
    jc.keep_compiled_programs()
    model = jc.case("1a")
    unknowns, truth = planted(model)
    edges = [(d, name, s) for name, speeds in EDGES.items() for d, s in followed(model, *speeds).items()]
    for (gap, e), name, edge in edges:
        print(f"{1e3 * gap:.2f} mm {1e6 * e:3.0f} um {name} {edge.value_rpm:10.2f} rpm, {edge.status}", flush=True)
    names = {d: f"{1e3 * d[0]:.2f} mm, {1e6 * d[1]:.0f} um" for d in DESIGNS}
    models = {names[d]: jc.replace(model, guidance_gap=d[0], eccentricity=d[1]) for d in DESIGNS}
    points = [jc.orbits.Point("period-doubling", float(jc.rpm(s.value_rpm)), np.asarray(s.state)) for *_, s in edges]
    rng, fits, began = np.random.default_rng(0), [], time.perf_counter()
    for draw in range(options.draws):
        noise, wrong = rng.normal(size=len(edges)), rng.normal(size=len(unknowns))
        guessed = [
            dataclasses.replace(u, prior=(truth[u.name] * float(np.exp(GUESS * n)), GUESS))
            for u, n in zip(unknowns, wrong, strict=True)
        ]
        measured = [
            jc.design.MeasuredEdge(names[d], name, s.value_rpm * (1 + NOISE * n), NOISE * s.value_rpm)
            for (d, name, s), n in zip(edges, noise, strict=True)
        ]
        fit = jc.fit_edges(models, guessed, measured, points, start=truth)
        fits.append(fit)
        print(f"draw {draw}: {fit.status}, chi^2 {fit.chi_square:.1f}, {fit.solves} solves", flush=True)
    print(f"{(time.perf_counter() - began) / options.draws:.1f} s a draw")
    for rank in range(len(unknowns)):
        own = [fit.combinations[rank] for fit in fits]
        off = [sum(w * np.log(f.values[n] / truth[n]) for n, w in c.weights.items()) for f, c in zip(fits, own)]
        held = sum(abs(o) <= c.half_width for o, c in zip(off, own))
        called = sum(c.identified for c in own)
        width = 100 * np.median([c.half_width for c in own])
        powers = str(own[0]).rpartition(":")[0]
        print(f"+-{width:8.2f} %  identified in {called:2d}, holds the truth in {held:2d} of {len(fits)}   {powers}")


if __name__ == "__main__":
    main()
