"""The orbit benchmark: every program has the same equations, and what is said of them follows from the numbers."""

import pathlib
import shutil

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks import auto, orbits, shooting
from benchmarks.orbit_tasks import TASKS, prepare


needs_compiler = pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler")
DOUBLING = TASKS["duffing-doubling"]
START = np.array([0.636641, 0.161231])
"""Its orbit at the first speed, in the units of the C equations, to six digits."""


def law(name: str, folder: pathlib.Path) -> shooting.Rates:
    """The equations in C of a task."""
    prepare(TASKS[name], folder)
    return shooting.compiled(folder, TASKS[name].law)


@pytest.mark.wide
@needs_compiler
@pytest.mark.parametrize("name", TASKS)
def test_equations_in_c_are_those_of_the_field(name: str, tmp_path: pathlib.Path):
    task, rates, rng = TASKS[name], law(name, tmp_path), np.random.default_rng(3)
    model, half = task.make(), task.dimension // 2
    touching = 0
    for ratio in (1.0, 0.8, 1.3):
        speed = ratio * task.speed
        scale = task.scale() * np.repeat([1.0, ratio], half)
        field = eqx.filter_jit(model.at_speed(jnp.asarray(speed)))
        for _ in range(20):
            z, tau = rng.uniform(-1, 1, task.dimension), rng.uniform(0, 7)
            if name == "cage":  # from the middle to beyond the onset of contact
                z[:2] *= rng.uniform(0, 1.02) / np.linalg.norm(z[:2])
                touching += np.linalg.norm(z[:2]) > float(model.contact.onset)
            expected = np.asarray(field(jnp.asarray(tau), tuple(jnp.asarray(scale * z)))) / scale
            np.testing.assert_allclose(rates(ratio, tau, z), expected, rtol=2e-10, atol=1e-12)
    assert touching > 1 or name != "cage"


@pytest.mark.skipif(auto.missing() is not None, reason=f"AUTO-07p: {auto.missing()}")
def test_auto_finds_a_published_doubling(tmp_path: pathlib.Path):
    rates = law("duffing-doubling", tmp_path)
    auto.build(tmp_path, DOUBLING.law)
    orbit = shooting.history(rates, START)
    found, _ = auto.run(tmp_path, orbit, DOUBLING.end / DOUBLING.begin, 50)
    ((kind, ratio),) = found["special"]
    assert kind == "period-doubling"
    assert ratio * DOUBLING.begin == pytest.approx(DOUBLING.known[0], abs=1e-8)


DIAGRAM = """
   0    PT  TY  LAB    PAR(1)             L2-NORM
  -1    -1   9    1  1.0000000000E+000  1.3337752407E+000
  -1    -2   0    0  1.1000000000E+000  1.3337752407E+000
  -1    -3   5    2  1.2457558946E+000  1.4665185527E+000
  -1     4   7    3  1.1956930951E+000  1.4200350661E+000
  -1     5  -4    4  1.2666666668E+000  1.4354242143E+000
"""


def test_diagrams_of_auto_are_read():
    assert auto.read(DIAGRAM) == {"points": 5, "special": [["fold", 1.2457558946], ["period-doubling", 1.1956930951]]}


def test_a_missing_point_is_not_within_any_error():
    autos = [orbits.Row("AUTO", special=(("fold", at),)) for at in (1.002, 1.001, 1.0)]
    row = lambda kind, error: orbits.Row("ours", special=((kind, 1.003), ("Neimark-Sacker", 1.0)), errors=(error, 0.0))
    assert orbits.within(row("fold", 0.004), autos) == pytest.approx(0.003 / 0.006)
    assert orbits.within(row("fold", 0.0), autos) == pytest.approx(1.5)
    assert orbits.within(row("period-doubling", 1.0), autos) == np.inf
    assert orbits.off(row("fold", 0.0), autos[-1]) == pytest.approx(0.003)
    assert orbits.off(row("period-doubling", 1.0), autos[-1]) == np.inf
