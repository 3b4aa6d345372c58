"""Maps of labels over two parameters: the same as sweeps, chaos that must persist, what a point counts as."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc
from jaxcage.studies import LABELS, kinds


class Ueda(eqx.Module):
    """x'' + 0.05 x' + x^3 = force cos t."""

    force: jax.Array

    def __call__(self, tau, q, v, speed):
        del speed
        (x,), (u,) = q, v
        return (-0.05 * u - x**3 + self.force * jnp.cos(tau),)


@pytest.mark.wide
def test_map_of_a_system_agrees_with_a_sweep():
    """Labels are those of sweeps; what a point counts as follows from all of its starts."""
    make = lambda force: jc.ForcedOscillator(Ueda(jnp.array(force)), coordinates=1)
    speeds, forces = np.linspace(0.9, 1.4, 9), np.linspace(4.0, 8.0, 8)
    length = dict(discard=60, revolutions=60, blocks=6, method=jc.method("rodas4", steps=32))
    found = jc.label_map(make(7.5), {"speed": speeds}, {"force": forces}, starts=2, **length)
    starts = [tuple(float(c) for c in s) for s in make(7.5).starts(1.0)[:2]]
    same, near = 0, 0
    for j in (0, 7):
        swept = jc.sweep(make(forces[j]), speeds, starts=starts, keep=16, confirm=False, horizon=0, **length)
        mine = np.array(LABELS)[found.label[:, j]]
        periodic = np.char.startswith(swept.label, "periodic")
        assert np.array_equal(mine[periodic], swept.label[periodic])
        agree = mine == swept.label
        assert np.mean(found.too_short[:, j][agree] == swept.too_short[agree]) > 0.9
        same, near = same + np.sum(agree), near + mine.size
    assert same >= 0.9 * near  # long chaotic lanes differ by rounding, and a few of their labels with them
    assert np.any(found.too_short) and "lanes have no certain label" in str(found)
    assert found.kind.shape == (9, 8) and 0 < np.sum(found.kind == 1) < found.kind.size
    assert np.array_equal(found.top_exponent, np.max(found.largest_exponent, axis=2))


@pytest.mark.wide
def test_chaos_must_persist_if_asked():
    """Starts found chaotic are judged again after more revolutions, all others stay as they were."""
    system = jc.ForcedOscillator(Ueda(jnp.array(7.5)), coordinates=1)
    x, y = {"speed": np.linspace(0.95, 1.15, 9)}, {"force": np.linspace(6.0, 8.0, 6)}
    length = dict(revolutions=60, blocks=6, method=jc.method("rk4", steps=64), starts=2)
    soon, late = (jc.label_map(system, x, y, discard=n, **length) for n in (20, 400))
    found = jc.label_map(system, x, y, discard=20, persist=400, **length)
    chaotic = soon.label == LABELS.index("chaotic")
    assert np.array_equal(found.label, np.where(chaotic, late.label, soon.label))
    assert np.array_equal(found.largest_exponent, np.where(chaotic, late.largest_exponent, soon.largest_exponent))
    died = chaotic & (found.label != LABELS.index("chaotic"))
    assert 0 < np.sum(died) < np.sum(chaotic)  # transients and attractors both
    with pytest.raises(ValueError, match="`persist` must be 0 or above the 20 revolutions discarded, but is 20"):
        jc.label_map(system, x, y, discard=20, persist=20, **length)
    with pytest.raises(ValueError, match="Arguments `x` and `y` must have at least 2 values each, but have 9 and 1"):
        jc.label_map(system, x, {"force": np.array([6.0])}, **length)


def test_what_a_point_counts_as():
    chaotic, failed, calm = (LABELS.index(name) for name in ("chaotic", "failed", "periodic-1"))
    label = np.array([[calm, calm], [calm, chaotic], [failed, chaotic], [failed, calm]])
    assert kinds(label).tolist() == [0, 1, 1, 2]
