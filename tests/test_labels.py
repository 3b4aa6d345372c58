"""Labels, zones and edges from made-up lanes; labels of short runs; maps of labels beside sweeps."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from helpers import followed, made_sweep

import jaxcage as jc
from jaxcage.analysis import (
    chaotic_share,
    closing_period,
    decay,
    label_lanes,
    lasting,
    motion_label,
    on_torus,
    restless,
    small,
    summary,
    to_decide,
    too_short,
)


def made(label_row: str, step_rpm: float = 100.0, initial_states: int = 1) -> xr.Dataset:
    """A sweep whose lanes carry the labels of the string: 1-8, # chaotic, q quasi-periodic, ? undecided, X failed."""
    n, keep, blocks = len(label_row), 32, 10
    rpm = 5000.0 + step_rpm * np.arange(n)
    strobe = np.zeros((n, initial_states, keep, 2))
    growth = np.zeros((n, initial_states, blocks, 1))
    outcome = np.zeros((n, initial_states), dtype=int)
    wiggle = np.sin(np.sqrt(2) * np.arange(keep))
    noise = 0.01 * np.cos(np.arange(blocks))
    for i, sign in enumerate(label_row):
        if sign.isdigit():
            strobe[i, 0, :, 0] = np.arange(keep) % int(sign)
            growth[i, 0, :, 0] = -0.3 + noise
        elif sign == "X":
            strobe[i], growth[i], outcome[i] = np.nan, np.nan, 1
        else:
            strobe[i, 0, :, 0] = wiggle
            growth[i, 0, :, 0] = {"#": 0.4, "q": 0.0, "?": -0.1}[sign] + (0.0 if sign == "q" else noise)
    return made_sweep(rpm, strobe, growth, outcome)


def test_closing_is_measured_by_the_size_of_the_motion_and_at_most_the_scale():
    strobe = np.array([0.0, 0.9e-4] * 16)[:, None]
    assert closing_period(strobe + 1, np.array([1.0])) == 1
    assert closing_period(strobe + 1, np.array([0.5])) == 2
    assert closing_period(strobe + 0.5, np.array([1.0])) == 2
    assert closing_period(strobe, np.array([1.0])) == 2
    assert closing_period(1e-10 * strobe, np.array([1.0])) == 1


def spiral(turn: float, size: float, shrinks: float = 0.985, orbit: tuple[float, ...] = (0.0,)) -> np.ndarray:
    """Strobe states on the way to an orbit, which they go round by `turn` in a revolution."""
    n = np.arange(64)
    z = size * shrinks**n * np.exp(2j * np.pi * turn * n)
    return np.stack([np.resize(orbit, 64) + z.real, 0.7 * z.imag], axis=1)


@pytest.mark.parametrize("turn", [0.5, 0.497, 0.401, 1 / 8])
@pytest.mark.parametrize("orbit", [(0.0,), (0.0, 0.5), (0.0, 0.2, 0.3)], ids=["1", "2", "3"])
def test_a_spiral_has_the_period_of_the_orbit_that_it_leads_to(turn: float, orbit: tuple[float, ...]):
    """Sizes at which the states return after more revolutions than the orbit has, and smaller ones."""
    found = {int(closing_period(spiral(turn, size, orbit=orbit), np.ones(2))) for size in (2e-3, 5e-4, 1e-4, 1e-5, 0.0)}
    assert found - {0} == {len(orbit)}


CIRCLE = spiral(0.618, 1.0, shrinks=1.0)


@pytest.mark.parametrize(
    "exponent, error, expected",
    [
        (0.05, 0.01, "chaotic"),
        (0.05, 0.02, "undecided"),
        (0.004, 0.0, "quasi-periodic"),
        (-0.004, 0.002, "quasi-periodic"),
        (0.0, 0.003, "undecided"),
        (0.03, 0.02, "undecided"),
        (-0.1, 0.01, "undecided"),
        (np.nan, np.nan, "undecided"),
    ],
)
def test_labels_by_exponent_and_error(exponent: float, error: float, expected: str):
    """A strobe orbit on a circle: its label follows from the exponent, and zero must be resolved."""
    got = label_lanes(np.array([0]), CIRCLE[None], np.ones(2), np.array([exponent]), np.array([error]))
    assert got[0] == expected


def test_failure_comes_first_and_closing_before_the_exponent():
    """But what closes while its neighbours part is too small to be told from an orbit, or rests on an unstable one."""
    twice = np.tile([[0.0, 1.0], [1.0, 0.0]], (32, 1))
    label = label_lanes(
        np.array([1, 0, 0, 0]),
        np.stack([np.full((64, 2), np.nan), twice, twice, twice]),
        np.ones(2),
        np.array([0.5, 0.5, 0.03, -1]),
        np.full(4, 0.01),
    )
    assert list(label) == ["failed", "undecided", "periodic-2", "periodic-2"]


@pytest.mark.parametrize("shrinks", [0.95, 0.995, 0.999, 1.001])
@pytest.mark.parametrize("turn", [0.03, 0.497, 0.618])
def test_a_spiral_is_no_torus_however_slow(shrinks: float, turn: float):
    states = spiral(turn, 0.1, shrinks)
    factor, error = decay(states)
    assert factor == pytest.approx(shrinks, abs=error) and error < 2e-4
    assert not on_torus(states[None], np.ones(2), np.zeros(1), np.zeros(1))[0]
    assert on_torus(spiral(turn, 0.1, 1.0)[None], np.ones(2), np.zeros(1), np.zeros(1))[0]


class SlowSpirals(eqx.Module):
    """A forced, hardening oscillator whose multipliers go from 0.95 to 0.999 as the speed goes from 1 to 2."""

    def __call__(self, tau, q, v, speed):
        multiplier = 0.95 + 0.049 * (speed - 1)
        damping = -speed * jnp.log(multiplier) / jnp.pi
        return (-damping * v[0] - 0.3 * q[0] - 0.2 * q[0] ** 3 + 0.1 * jnp.cos(tau),)


@pytest.mark.parametrize("revolutions", [20, 120, 600])
def test_slow_spirals_are_not_called_quasi_periodic(revolutions: int):
    """50 lanes, multipliers from 0.95 to 0.999: periodic-1 once they have closed, undecided with a cure before that."""
    system = jc.ForcedOscillator(SlowSpirals(), coordinates=1)
    settings = dict(discard=revolutions, revolutions=revolutions, confirm=False, horizon=0, initial_states=1)
    found = jc.sweep(system, np.linspace(1, 2, 50), **settings, method=jc.method("rk4", steps=64))
    open_ = found["label"].values == "undecided"
    assert np.all(open_ | (found["label"].values == "periodic-1"))
    assert np.array_equal(too_short(found), open_) and np.all(to_decide(found)[open_] > revolutions)
    if np.any(open_):
        assert "lanes have no certain label: about" in summary(found)


def test_labels_of_short_runs_of_a_cage_are_undecided_and_the_default_decides():
    """Case 1a from 13 000 to 17 500 rpm: slow spirals onto periodic orbits, the slowest with a multiplier of 0.997.

    At 18 000 rpm a chaotic transient leads to one of two orbits, and rounding decides to which.
    """
    model, speeds = jc.case("1a"), jc.rpm(13000, 17500, 10)
    short = jc.sweep(model, speeds, discard=200, revolutions=60, confirm=False, horizon=0)
    assert not np.any(short["label"] == "quasi-periodic") and np.mean(short["label"] == "undecided") > 0.8
    assert np.all(jc.sweep(model, speeds).label == "periodic-1")


@pytest.mark.parametrize("scale", [1.0, 1e-5])
def test_small_motion_is_labelled_by_its_own_size(scale: float):
    """A forced oscillator of van der Pol with an amplitude of 2e-5: quasi-periodic at either scale."""

    def law(tau, q, v, speed):
        return (0.5 * (1 - (1e5 * q[0]) ** 2) * v[0] - q[0] + 3e-6 * jnp.cos(tau),)

    system = jc.ForcedOscillator(law, coordinates=1, scale=scale, initial_states=((1e-5, 0.0),))
    found = jc.sweep(system, np.array([1.9, 2.3]), confirm=False)
    assert np.all(found.label == "quasi-periodic")
    assert np.all(small(found)) == (scale == 1.0) == ("choose a smaller `scale`" in summary(found))


def test_narrow_windows_are_closed_and_wide_ones_are_not():
    found = jc.zones(made("11###111##11"), 500.0)  # chaotic at 5200-5400 and 5800-5900: a window of 400 rpm
    (zone,) = found.zones
    assert zone.onset is not None and zone.exit is not None
    assert (zone.onset.speed_rpm, zone.exit.speed_rpm) == pytest.approx((5150, 5950))
    assert zone.width_rpm == pytest.approx(800)
    assert zone.onset.uncertainty_rpm == pytest.approx(100) and zone.onset.kind == "chaotic"
    assert len(jc.zones(made("11###1111##11"), 500.0).zones) == 2
    parts = made("11###111##11").isel(speed=np.r_[6:12, 0:6])  # joined in another order
    assert jc.zones(parts, 500.0) == found


def test_zones_that_run_past_the_range_are_open():
    first, last = jc.zones(made("##11111111#")).zones
    assert first.onset is None and first.exit is not None and first.width_rpm is None
    assert last.onset is not None and last.exit is None


def test_failed_speeds_are_neither_chaotic_nor_calm():
    """An edge next to speeds that failed is as uncertain as the gap they leave."""
    (zone,) = jc.zones(made("11XX##11")).zones
    assert zone.onset is not None
    assert zone.onset.speed_rpm == pytest.approx(5250) and zone.onset.uncertainty_rpm == pytest.approx(300)
    (zone,) = jc.zones(made("XX##11")).zones
    assert zone.onset is None
    sweep = made("XX##11")
    assert np.isnan(chaotic_share(sweep)[0]) and chaotic_share(sweep)[2] == 1.0


def test_synchronous_stretches_end_where_period_one_is_lost():
    stretch = jc.zones(made("11122##q11")).synchronous
    assert [z.exit and z.exit.speed_rpm for z in stretch] == [pytest.approx(5250), None]
    assert all(z.kind == "synchronous" for z in stretch)
    assert all(e.kind == "unstable" for z in stretch for e in (z.onset, z.exit) if e)


def test_chaos_that_lasts_and_chaos_that_dies_out_make_zones_of_their_own():
    """Escapes of made-up lanes: the mean life at a speed is that of the lanes there and next to it."""
    sweep = made("11###11###11")
    escape = np.full(sweep["label"].shape, 20.0)
    escape[2:5], escape[7:10] = np.inf, 320.0
    later, rpm = followed(sweep, escape, 3020), sweep["rpm"].values
    assert np.array_equal(np.flatnonzero(lasting(later)), [2, 3, 4])
    assert np.array_equal(np.flatnonzero(restless(later)), [2, 3, 4, 7, 8, 9])
    found = jc.zones(later, close_below_rpm=0.0)
    (staying,), (dying,) = found.zones, found.transient
    assert staying.onset.speed_rpm == pytest.approx((rpm[1] + rpm[2]) / 2)
    assert dying.exit.speed_rpm == pytest.approx((rpm[9] + rpm[10]) / 2)
    assert staying.life is not None and dying.life is not None
    shortest, longest = staying.life  # bounds: two lanes at the rim, three within
    assert shortest == (pytest.approx(2 * 3000 / 3), pytest.approx(rpm[2]), True)
    assert longest == (pytest.approx(3 * 3000 / 3), pytest.approx(rpm[3]), True)
    n, survived, block = 3, 3 * 270, 30  # three escapes in the block that ends 300 revolutions after the first begins
    assert dying.life[1].revolutions == pytest.approx(block / np.log1p(n * block / survived))
    assert dying.life[1].seconds == pytest.approx(dying.life[1].revolutions * 60 / dying.life[1].speed_rpm)
    assert "beyond 3020 revolutions" in str(found) and "Transient chaos" in str(found)
    assert "mean life > 2000 revolutions" in str(found)
    assert jc.zones(sweep, close_below_rpm=0.0).transient == ()


def test_a_window_that_no_speed_makes_certain_is_closed():
    """Either 14 of the 20 lanes at the five middle speeds leave chaos late, or all of them leave it soon."""
    sweep = made("11###########11", initial_states=20)
    sweep = sweep.isel(initial_state=np.zeros(20, dtype=int))
    for leaving, at, count in ((14, 1520.0, 1), (20, 320.0, 2)):
        escape = np.full(sweep["label"].shape, 20.0)
        escape[2:13] = np.inf
        escape[5:10, :leaving] = at
        later = followed(sweep, escape, 3020)
        assert not lasting(later)[6:9].any() and len(jc.zones(later, close_below_rpm=0.0).zones) == count


def test_an_edge_is_no_more_certain_than_the_mean_lives_next_to_it():
    """Lanes that leave chaos at the first two speeds of a zone: none; 12 of 20, late; all of them, soon."""
    sweep = made("111####11", initial_states=20)
    sweep = sweep.isel(initial_state=np.zeros(20, dtype=int))
    for leaving, at, onset, apart in ((0, 2000.0, 5250, 100), (12, 2000.0, 5250, 150), (20, 320.0, 5450, 100)):
        escape = np.full(sweep["label"].shape, 20.0)
        escape[3:7] = np.inf
        escape[3:5, :leaving] = at
        found = jc.zones(followed(sweep, escape, 3020), close_below_rpm=0.0)
        assert found.zones[0].onset.speed_rpm == pytest.approx(onset)
        assert found.zones[0].onset.uncertainty_rpm == pytest.approx(apart)
        assert found.zones[0].exit.uncertainty_rpm == pytest.approx(100)


def test_the_exponent_of_a_stretch_has_the_error_of_its_speeds():
    """The mean has no error from the growth of the exponent with speed."""
    growth = np.array([[50.0, 52.0], [30.0, 32.0]])
    data = {"label": (("speed", "initial_state"), np.full((2, 1), "disordered"))}
    data |= {"block_growth": (("speed", "initial_state", "growth_block", "exponent"), growth[:, None, :, None])}
    (found,) = jc.stretches(xr.Dataset(data, coords={"rpm": ("speed", [1000.0, 2000.0])}))
    assert (found.exponent, found.exponent_error) == pytest.approx((41.0, np.sqrt(2) / 2))


@pytest.mark.parametrize("revolutions", [20, 200])
def test_a_motion_near_a_limit_is_undecided(revolutions: int):
    """The cage scatters about a fixed place, where the mean distance of positions one revolution apart is sigma times
    sqrt(pi). On the limit nine of ten records are undecided; at 1.04 times the limit 200 revolutions decide."""

    def labels(mean: float) -> list[str]:
        rng, records = np.random.default_rng(5), range(100)
        shape = (64 * revolutions + 1, 2)
        return [motion_label([0.5, 0.0] + mean / np.sqrt(np.pi) * rng.standard_normal(shape), 64) for _ in records]

    assert set(labels(0.08)) == {"locally_periodic"} and set(labels(0.12)) == {"disordered"}
    assert labels(0.1).count("undecided") >= 80
    assert set(labels(0.104)) == ({"disordered"} if revolutions > 100 else {"disordered", "undecided"})
