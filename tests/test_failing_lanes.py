"""Lanes that fail are NaN in their own place and change no other; a cage is never outside its land in silence."""

import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from helpers import even, preliminary, raw_sweep, wide_but

import jaxcage as jc
from jaxcage.analysis import chaotic_share, failed, summary, too_short


MODEL = preliminary("1a")
RPM = np.pi / 30
C = 0.45e-3
HEALTHY = (0.4 * C, 0.3 * C, 0.0, 0.0)
OTHER = (0.0, -0.5 * C, 0.0, 0.0)
THIRD = (0.1 * C, -0.2 * C, 0.0, 0.1)
METHOD = jc.method("rk4", steps=256)
SETTINGS = dict(discard=12, revolutions=16, blocks=4, keep=8, confirm=False, horizon=0, method=METHOD)
SPEEDS = RPM * np.array([9000.0, 15000.0])
FIELDS = "strobe", "last", "block_growth", "peak", "outcome"


def assert_same_bytes(first, second, keep):
    for field in FIELDS:
        here, there = (np.ascontiguousarray(r[field].values[keep]) for r in (first, second))
        assert here.tobytes() == there.tobytes(), field


def assert_failed(result, lane):
    assert result["outcome"].values[lane] != "successful" and result["label"].values[lane] == "failed"
    assert all(np.all(np.isnan(result[name].values[lane])) for name in ("last", "strobe", "exponents"))


BAD_STARTS = {
    "outside": ((1.5 * C, 0.0, 0.0, 0.0), "outside"),
    "not a number": ((float("nan"), 0.0, 0.0, 0.0), "not_finite"),
    "infinite": ((0.0, 0.0, float("inf"), 0.0), "not_finite"),
    "absurdly fast": ((0.0, 0.0, 1e200, 0.0), None),
}


@pytest.mark.parametrize("confirm", wide_but([False, True], False))
@pytest.mark.parametrize("place", [0, 2])
@pytest.mark.parametrize("bad", BAD_STARTS)
def test_bad_start_fails_alone(bad, place, confirm):
    start, outcome = BAD_STARTS[bad]
    states = [HEALTHY, OTHER, THIRD]
    settings = SETTINGS | (dict(confirm=True, horizon=3000) if confirm else {})
    healthy = jc.sweep(MODEL, SPEEDS, initial_states=states, **settings)
    assert not np.any(failed(healthy))
    states[place] = start
    mixed = jc.sweep(MODEL, SPEEDS, initial_states=states, **settings)
    others = np.s_[:, [i for i in range(3) if i != place]]
    assert_same_bytes(mixed, healthy, others)
    np.testing.assert_array_equal(mixed["label"].values[others], healthy["label"].values[others])
    for k in range(SPEEDS.size):
        assert_failed(mixed, (k, place))
        if outcome is not None:
            assert mixed["outcome"].values[k, place] == outcome
    # Shares are of the initial states that finished.
    share = np.sum(healthy["label"].values[others] == "chaotic", axis=1) / 2
    np.testing.assert_array_equal(chaotic_share(mixed), share)


THROWS = np.array([1.0, 3.0, 10.0, 100.0])
"""Speeds [m/s] at which a cage leaves the middle: at the last one it has energy to cross the rib."""


def thrown(model: jc.CageModel, method: jc.solve.AbstractMethod) -> tuple[np.ndarray, xr.Dataset]:
    """A revolution of cages that leave the middle in six directions, and the speed of each."""
    speed, angle = (x.ravel() for x in np.meshgrid(THROWS, np.arange(6) * np.pi / 3, indexing="ij"))
    initial_states = [(0.0, 0.0, float(v * np.cos(a)), float(v * np.sin(a))) for v, a in zip(speed, angle, strict=True)]
    length = dict(discard=0, revolutions=1, blocks=1, exponents=0)
    return speed, raw_sweep(model, jc.rpm(9000.0), initial_states=initial_states, method=method, **length)


@pytest.mark.wide
@pytest.mark.parametrize("solver, steps", [("rk4", 16), ("rk4", 128), ("tsit5", 64), ("rodas4", 32)])
def test_a_cage_thrown_at_the_rib_is_never_outside_in_silence(solver: str, steps: int):
    """With steps too large by far for the contact a lane is refused, or tells how far out it was."""
    speed, found = thrown(even(MODEL), jc.method(solver, steps=steps))
    lost, peak = failed(found)[0], found["peak"].values[0]
    assert np.all(lost[speed == 100.0]) and np.all(peak[~lost] <= 2)
    assert np.all(np.isnan(found["last"].values[0][lost])) and np.all(found["label"].values[0][lost] == "failed")
    assert np.any(lost[speed == 10.0] | ~(peak[speed == 10.0] <= 1))  # with steps like these some leave


@pytest.mark.wide
def test_with_fine_steps_the_rib_turns_a_thrown_cage_back():
    """Nothing goes deeper than where the contact has taken all its energy; what has more than that is refused."""
    model = jc.case("1a")
    speed, found = thrown(model, jc.method("rk4", steps=1024))
    lost, peak, hard = failed(found)[0], found["peak"].values[0], speed < 100
    energy = 0.5 * float(model.cage_mass) * speed**2
    depth = (19 / 9 * energy / float(model.contact.stiffness)) ** (9 / 19)
    limit = float(model.contact.onset) + depth / float(model.clearance)
    assert np.all(limit[~hard] > 2) and np.array_equal(lost, ~hard) and np.all(peak[hard] < limit[hard])
    assert np.all(peak[hard] > float(model.contact.onset))  # every one of them met the wall
    fast = speed == 10.0
    assert np.all(peak[fast] > 1 + 0.6 * (limit[fast] - 1))


@pytest.mark.wide
def test_a_short_sweep_says_so_and_a_long_one_does_not():
    """The chaotic oscillator of Ueda: 0.65 a revolution."""
    ueda = lambda tau, q, v, speed: (-0.05 * v[0] - q[0] ** 3 + 7.5 * jnp.sin(tau),)
    system = jc.ForcedOscillator(ueda, coordinates=1)
    lengths = {"discard": 20, "method": jc.method("rk4", steps=64), "keep": 8}
    single, long = (
        raw_sweep(system, np.array([1.0]), revolutions=n, blocks=blocks, **lengths)
        for n, blocks in ((100, 1), (400, 20))
    )
    assert np.all(long["label"] == "chaotic") and not np.any(too_short(long))
    assert "no certain label" not in summary(long)
    assert np.all(single["label"] == "undecided") and np.all(too_short(single))  # a single block has no error
    assert "3 lanes have no certain label" in summary(single)
