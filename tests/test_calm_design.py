"""Designs for calm operation: edges followed from design to design, gradients of requirements, and optima.

Gradients stand beside differences of solutions by SciPy's DOP853 and Newton's method, which share only the field with
this library. "Planted" systems have edges, and so optima, that are known exactly.
"""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from laws import about_an_orbit
from shooting import edge_speed, orbit, readings

import jaxcage as jc
from jaxcage.design import DesignSpace, OperatingRange, Price, Requirements, Tolerance, Value
from jaxcage.design.requirements import listed
from jaxcage.forces import parameter
from jaxcage.orbits import follow, stable_range


pytestmark = pytest.mark.wide  # minutes, most of them compilation


class Window(eqx.Module):
    """The orbit (cos, sin) with the multipliers -exp((g + l) T), l = -s/2 +- sqrt(s^2/4 + r): l is 0 and -1 without r.
    g = k ((w - x)(w - x - y) - d) then vanishes where the period doubles, at the speeds x and x + y without d."""

    x: jax.Array = parameter("1", -9.0, 9.0, "first edge")
    y: jax.Array = parameter("1", -9.0, 9.0, "distance of both edges")
    d: jax.Array = parameter("1", -9.0, 9.0, "shift of the parabola")
    k: jax.Array = parameter("1", -9.0, 9.0, "bend of the parabola")
    s: jax.Array = parameter("1", -9.0, 9.0, "sum of both rates")
    r: jax.Array = parameter("1", -9.0, 9.0, "coupling")

    def __call__(self, tau, y, speed):
        growth = self.k * ((speed - self.x) * (speed - self.x - self.y) - self.d)
        rates = lambda e, f: ((growth - e * e - f * f) * e + self.r * f, (growth - self.s - e * e - f * f) * f + e)
        return about_an_orbit(tau, y, speed, 0.5, rates)


def window(x=1.0, y=1.5, d=0.0, k=0.5, s=1.0, r=0.0):
    return jc.ForcedSystem(Window(x=x, y=y, d=d, k=k, s=s, r=r), dimension=2)


OPERATING, LIMITS = (1.2, 2.0), (0.6, 4.0)


@pytest.fixture(scope="module")
def planted():
    found = stable_range(window(), OPERATING, LIMITS)
    assert found.lower.kind == found.upper.kind == "period-doubling"
    return found


def test_an_edge_within_the_narrow_speeds_where_contact_begins_is_located():
    """Near 27473 rpm the period doubles a few rpm before a pair of multipliers leaves the unit circle; the steps along
    the branch are hundreds of rpm long there."""
    model = jc.replace(
        jc.case("3a"),
        **{"guidance_gap": 0.6e-3, "eccentricity": 36.006e-6, "temperature": 303.15, "land_width": 2.0132e-3},
        **{"cage_mass": 0.30251, "rib_diameter": 0.093798, "amplitude": 84.904, "stiffness": 1.7527e9},
    )
    rpm = np.pi / 30
    found = stable_range(model, (12500 * rpm, 18500 * rpm), (6250 * rpm, 37000 * rpm)).upper
    assert found is not None and found.kind == "period-doubling"
    orbit_there = jc.periodic_orbit(model, found.speed, guess=found.state)
    assert np.min(np.abs(np.asarray(orbit_there.multipliers) + 1)) < 1e-4


# --- following ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["lower", "upper"])
def test_a_planted_edge_is_followed_to_its_place(planted, end):
    """Far: by six times the width of the range. Derivatives are 1 and, for the upper edge, 1."""
    found = follow(window(), getattr(planted, end), window(x=1.4, y=1.3), lower=0.6, upper=4.0, name=end)
    exact = 1.4 if end == "lower" else 2.7
    assert (found.ended, found.share, found.edge.kind, found.edge.name) == ("", 1.0, "period-doubling", end)
    assert found.edge.value_rpm * np.pi / 30 == pytest.approx(exact, rel=1e-7) and found.edge.bounds
    slopes = [found.edge.derivative[name] * np.pi / 30 for name in ("x", "y", "k")]
    assert slopes == pytest.approx([1.0, float(end == "upper"), 0.0], abs=1e-6)


@pytest.mark.parametrize("end", ["lower", "upper"])
def test_an_edge_that_meets_the_other_turns_back(planted, end):
    """The edges are at x + y/2 +- sqrt(y^2/4 + d): they meet at d = -y^2/4, at 0.5625 of the way to -1."""
    found = follow(window(), getattr(planted, end), window(d=-1.0), lower=0.6, upper=4.0)
    assert found.edge is None and found.ended == "turned back"
    assert found.share == pytest.approx(0.5625, abs=5e-3)


def test_a_change_within_rounding(planted):
    found = follow(window(), planted.lower, window(x=1 + 4e-16), lower=0.6, upper=4.0)
    assert found.edge.value_rpm * np.pi / 30 == pytest.approx(1.0, rel=1e-7)


def test_an_edge_that_leaves_the_range(planted):
    """The lower edge passes 0.8 at 0.4 of the way."""
    found = follow(window(), planted.lower, window(x=0.5, y=2.0), lower=0.8, upper=4.0)
    assert found.edge is None and found.ended == "left the range" and 0.4 <= found.share < 1


def test_a_torus_bifurcation_that_becomes_a_neutral_saddle():
    """Without s the multipliers are a pair for r < 0 and real for r > 0: no edge any more, and without sensitivity."""
    before, other = window(s=0.0, r=-0.04), window(x=1.1, s=0.0, r=0.04)
    point = stable_range(before, OPERATING, LIMITS).lower
    near = follow(before, point, window(x=1.1, s=0.0, r=-0.01), lower=0.6, upper=4.0).edge
    assert near.kind == "Neimark-Sacker" and near.value_rpm * np.pi / 30 == pytest.approx(1.1, rel=1e-7) and near.bounds
    assert follow(before, point, other, lower=0.6, upper=4.0)[:2] == (None, "neutral saddle")
    lost = jc.sensitivity(other, jc.Point("Neimark-Sacker", 1.1, np.array([1.0, 0.0])))
    assert lost.status == "other kind" and np.isnan(lost.value_rpm)


CASE = jc.case("1a")
GAP, RUNNING = float(jc.parameters(CASE)["guidance_gap"]), (float(jc.rpm(12500)), float(jc.rpm(18000)))
FAR = 0.5 * RUNNING[0], 2 * RUNNING[1]


@pytest.fixture(scope="module")
def given():
    return stable_range(CASE, RUNNING, FAR)


@pytest.mark.parametrize("change", (0.001, 0.007, 0.02, 0.11))
def test_the_fold_of_a_cage_is_followed(given, change):
    """The onset of the second unstable range (18686 rpm) is followed to where a search finds it in the new design."""
    assert given.upper.kind == "fold" and float(given.upper.speed_rpm) == pytest.approx(18686.338, abs=1e-2)
    other = jc.replace(CASE, guidance_gap=(1 + change) * GAP)
    found = follow(CASE, given.upper, other, lower=FAR[0], upper=FAR[1])
    fresh = stable_range(other, RUNNING, FAR).upper
    assert found.ended == "" and found.edge.kind == fresh.kind == "fold" and found.edge.bounds
    assert found.edge.value_rpm == pytest.approx(float(fresh.speed_rpm), rel=1e-6)
    assert found.edge.value_rpm > float(given.upper.speed_rpm) * (1 + 0.9 * change)


# --- gradients ------------------------------------------------------------------------------------------------------


@functools.cache
def range_of(rpm):
    """Speeds [rpm] with the orbits of case 1a there."""
    now = {n: float(jc.parameters(CASE)[n]) for n in ("guidance_gap", "eccentricity")}
    space = DesignSpace.of(CASE, {n: (0.8 * v, 1.2 * v) for n, v in now.items()})
    return OperatingRange(space, tuple(float(jc.rpm(end)) for end in rpm))


CALM, TOUCHED = (12500.0, 18000.0), (20397.5, 20602.5)
"""The land is touched in the second range."""


def independent(range_, quantity, value):
    """A value of the range as a function of the design, at the speed to which it belongs."""
    speed = float(jc.rpm(value.rpm))
    scale = np.array([float(s) for s in CASE.scale(speed)])
    if quantity.endswith("margin"):
        edge = range_.edges(range_.space.place)[quantity.split()[0]]
        end, sign = (range_.operating[0], -1) if quantity == "lower margin" else (range_.operating[1], 1)
        return lambda m: 100 * sign * (edge_speed(m, edge.kind, speed, edge.state / scale) / end - 1)
    through = range_.through(range_.space.place)
    z = through.state(speed) / scale
    if quantity == "multiplier":
        return lambda m: np.max(np.abs(np.linalg.eigvals(orbit(m, speed, z)[1])))
    return lambda m: readings(m, speed, z)[quantity]


GRADIENTS = [
    *((CALM, quantity, 1e-4, 1e-5) for quantity in ("lower margin", "upper margin")),
    *((CALM, quantity, 5e-4, 1e-5) for quantity in ("multiplier", "film", "drag")),
    *((TOUCHED, quantity, 1e-4, 1e-3) for quantity in ("lower margin", "upper margin")),
    *((TOUCHED, quantity, 1e-4, 1e-3) for quantity in ("multiplier", "film", "land force", "drag")),
]
ALL = [("guidance_gap", *row) for row in GRADIENTS] + [("eccentricity", *row) for row in GRADIENTS[:5]]


@pytest.mark.slow
@pytest.mark.parametrize("name, where, quantity, step, tolerance", ALL)
def test_gradients_of_requirements(name, where, quantity, step, tolerance):
    """Against differences of fourth order, to 1e-5, and 1e-3 where the land is touched."""
    range_ = range_of(where)
    place = range_.space.place
    margins, worst = range_.margins(place), range_.worst(place, ("multiplier", "film", "land force", "drag"))
    assert not isinstance(margins, str) and not isinstance(worst, str)
    found = margins | worst
    f, now = independent(range_, quantity, found[quantity]), float(jc.parameters(CASE)[name])
    at = [f(jc.replace(CASE, **{name: now * (1 + i * step)})) for i in (-2, -1, 0, 1, 2)]
    assert at[2] == pytest.approx(found[quantity].value, rel=0.02 * tolerance**0.5, abs=1e-4 * ("margin" in quantity))
    i = range_.space.names.index(name)
    expected = np.dot([1, -8, 0, 8, -1], at) / (12 * step * now) * range_.space.span[i]
    assert found[quantity].slope[i] == pytest.approx(expected, rel=tolerance)


def test_contact_is_forbidden_at_the_gap_of_each_design():
    """It begins at `onset` times the clearance of that design, which the gap changes."""
    space, keep = range_of(CALM).space, listed(Requirements(land_force=0.0), CASE)
    place = space.place + np.array([0.25, 0.0])
    found = range_of(CALM).worst(place, ("film", "contact"))
    wider, onset = space.model(place), float(CASE.contact.onset)
    apart, slope = (x * keep[-1].size for x in keep[-1].slack(found["contact"]))
    assert apart == pytest.approx(found["film"].value - (1 - onset) * float(wider.clearance), abs=1e-12)
    by_gap = (1 - onset) * float(wider.clearance / wider.guidance_gap)
    np.testing.assert_allclose(slope, found["film"].slope - [by_gap * space.span[0], 0.0], rtol=1e-9)


# --- designs --------------------------------------------------------------------------------------------------------


def test_the_worst_multiplier_of_a_planted_range():
    """It is exp(2 pi g / w) where that is largest, at the lower end; there dg/dx = 0.55 and dg/dy = -0.1."""
    space = DesignSpace.of(window(), {"x": (0.7, 1.3), "y": (0.9, 1.6)})
    worst = OperatingRange(space, OPERATING).worst(space.place, ("multiplier",))["multiplier"]
    size = lambda w: np.exp(2 * np.pi * 0.5 * (w - 1.0) * (w - 2.5) / w)
    assert size(1.2) == max(size(np.linspace(*OPERATING, 99)))
    assert worst.value == pytest.approx(size(1.2), rel=1e-7) and float(jc.rpm(worst.rpm)) == pytest.approx(1.2)
    slope = worst.value * 2 * np.pi / 1.2 * np.array([0.55 * 0.6, -0.1 * 0.7])
    np.testing.assert_allclose(worst.slope, slope, rtol=1e-5)


VARY = {"x": (0.7, 1.3), "y": (0.9, 1.6)}
KEEP = Requirements(margin=10.0)
LOWER, UPPER = "margin at the lower end", "margin at the upper end"


def cost(system):
    """1/x + y^2. With margins of 10 per cent from 1.2 to 2 x is at most 1.08 and x + y at least 2.2."""
    return 1 / system.rates.x + system.rates.y**2


def designed(**changed):
    settings = dict(vary=VARY, keep=KEEP, cost=cost, check=0) | changed
    return jc.design_for(window(), OPERATING, **settings)


def test_the_optimum_and_its_prices():
    """Both margins bind: with multipliers p, q of 1.08 - x and x + y - 2.2, q = 2 y and p = q + 1/x^2; one per cent
    more moves the limits by 0.012 and 0.02. A check by simulations finds it calm."""
    found = designed(check=8)
    assert found.feasible and found.verdict == "calm" and not found.at_bound and not found.conflict
    assert found.checked.calm and found.cost_before == pytest.approx(1 + 1.5**2)
    assert [found.values[n] for n in ("x", "y")] == pytest.approx([1.08, 1.12], abs=1e-5)
    assert found.cost == pytest.approx(1 / 1.08 + 1.12**2, abs=1e-5)
    assert found.prices[LOWER] == pytest.approx(0.012 * (2.24 + 1.08**-2), rel=1e-3)
    assert found.prices[UPPER] == pytest.approx(0.02 * 2.24, rel=1e-3) and set(found.prices) == {LOWER, UPPER}
    assert [found.before[n].value for n in ("lower margin", "upper margin")] == pytest.approx([100 / 6, 25], abs=1e-4)
    assert [found.after[n].value for n in ("lower margin", "upper margin")] == pytest.approx([10, 10], abs=1e-3)


def test_the_optimum_by_an_augmented_lagrangian():
    found = designed(search="augmented")
    assert found.feasible and found.cost == pytest.approx(1 / 1.08 + 1.12**2, rel=0.01)


def test_a_bound_takes_the_place_of_a_requirement():
    """x ends at its bound, where the lower margin has no price."""
    found = designed(vary=VARY | {"x": (0.7, 1.0)})
    assert found.at_bound == ("x",) and [found.values[n] for n in ("x", "y")] == pytest.approx([1.0, 1.2], abs=1e-5)
    assert found.prices == pytest.approx({UPPER: 0.02 * 2.4}, rel=1e-3)


def test_tolerances_are_met_at_their_worst_corner():
    """x + 0.02 is at most 1.08, and x - 0.02 + y - 0.03 at least 2.2; each tolerance uses all that it may."""
    found = designed(tolerance={"x": Tolerance(-0.02, 0.02), "y": Tolerance(-0.03, 0.03)})
    assert found.feasible and [found.values[n] for n in ("x", "y")] == pytest.approx([1.06, 1.19], abs=1e-5)
    assert [found.worst[n].value for n in (LOWER, UPPER)] == pytest.approx([10, 10], abs=1e-3)
    assert found.after["upper margin"].value == pytest.approx(12.5, abs=1e-3)
    assert {b.name: (b.width, round(b.factor, 2)) for b in found.budget} == {"x": (0.04, 1.0), "y": (0.06, 1.0)}


@pytest.mark.parametrize(
    "ends, factor, limit", [((0.0, 0.04), 2.0, LOWER), ((0.02, 0.04), 3.0, LOWER), ((0.0, 0.01), 4.0, "")]
)
def test_a_tolerance_to_one_side_may_be_as_wide_as_its_end_allows(ends, factor, limit):
    """x is at its bound, its upper end may be up to 1.08, and more than four times the width is not tried."""
    found = designed(vary=VARY | {"x": (0.7, 1.0)}, tolerance={"x": Tolerance(*ends)})
    (row,) = found.budget
    assert (row.width, row.limit) == (ends[1] - ends[0], limit) and row.factor == pytest.approx(factor, rel=1e-3)


def test_a_search_whose_tolerances_allow_no_stable_orbit():
    """Both edges meet at d = -y^2/4 at the latest: beyond it no orbit is stable."""
    found = designed(tolerance={"d": Tolerance(-0.7, 0.01)})
    assert not found.feasible and found.lost == "within the tolerances: no stable orbit in the operating range"
    assert not found.short and not found.conflict and found.lost in str(found) and f"{LOWER}: unknown" in str(found)


def test_requirements_that_exclude_each_other_are_named():
    """With y at most 1 both margins are best at x = 1.125, and short by 3.75 per cent."""
    found = designed(vary=VARY | {"y": (0.7, 1.0)})
    assert not found.feasible and found.verdict == "not feasible"
    assert [found.values[n] for n in ("x", "y")] == pytest.approx([1.125, 1.0], abs=1e-4)
    assert found.short == pytest.approx({LOWER: 3.75, UPPER: 3.75}, abs=1e-2)
    assert set(found.conflict) == {LOWER, UPPER, "the bound of y"}
    assert "in conflict: " in str(found) and "and the bound of y" in str(found)


def test_the_least_width_of_an_unstable_range():
    """It is the root of y^2 + 4 d, which y = 0 makes least."""
    found = jc.design_for(window(y=0.8, d=0.01, k=-0.5), (0.5, 2.5), {"y": (-0.5, 1.0)}, objective="width", check=0)
    assert found.cost_before == pytest.approx(30 / np.pi * np.sqrt(0.8**2 + 0.04), rel=1e-6)
    assert abs(found.values["y"]) < 0.02 and found.cost == pytest.approx(30 / np.pi * 0.2, rel=5e-3)


def test_an_unstable_range_that_is_born_stops_the_search_there():
    """The largest multiplier between is exp(2 pi k (-d)/x) at x, and passes 1 where d = 0; no edge bounds the range."""
    begin, reward = window(y=0.0, d=-0.2, k=-0.5), lambda system: 1 - system.rates.d
    found = jc.design_for(begin, (0.8, 1.2), {"d": (-0.3, 0.3)}, KEEP, reward, check=0)
    assert found.feasible and found.values["d"] == pytest.approx(0.0, abs=1e-3) and not found.notes
    assert set(found.prices) == {"no unstable speeds between"}


def test_a_search_goes_on_beyond_an_unstable_range():
    """From x - sqrt(d) to x + sqrt(d), born at d = 0 in the operating range; then x moves it above the margin."""
    begin, reward = window(x=1.15, y=0.0, d=-0.04, k=-0.5), lambda system: 1 - 10 * system.rates.d
    found = jc.design_for(begin, (0.8, 1.2), {"x": (0.9, 2.0), "d": (-0.05, 0.05)}, KEEP, reward, check=0)
    assert found.feasible and found.values["d"] == pytest.approx(0.05, abs=1e-4) and found.notes
    assert found.values["x"] >= 1.32 + np.sqrt(found.values["d"]) - 1e-3


@pytest.mark.parametrize(("lower", "upper", "known"), [(5.0, 30.0, True), (30.0, 5.0, False)])
def test_an_edge_that_jumps_concerns_its_own_margin(monkeypatch, lower, upper, known):
    """A search may go on where one edge jumps beyond its margin, although the other margin is not kept yet."""
    range_ = OperatingRange(DesignSpace.of(window(), VARY), OPERATING, KEEP.margin)
    still = np.zeros(len(VARY))

    def margins(place):
        range_.handed_over.append("upper edge: turned back; now 30 rpm, fold")
        return {"lower margin": Value(lower, still), "upper margin": Value(upper, still), "peak": Value(0.0, still)}

    monkeypatch.setattr(range_, "margins", margins)
    found = range_.values(range_.space.place, listed(KEEP, window()))
    assert isinstance(found, dict) == known and len(range_.handed_over) == known


def test_an_edge_that_comes_in_where_the_range_was_open():
    """The upper edge x + y comes in from 4.2, beyond the limit of the search at 4, to 3: 50 % above the range."""
    found = jc.design_for(window(y=3.2), OPERATING, {"y": (2.0, 3.3)}, KEEP, cost, check=0)
    assert found.feasible and found.at_bound == ("y",)
    assert found.after["upper margin"].value == pytest.approx(50, abs=1e-3)


class Bent(eqx.Module):
    """The orbit e^3 - p e = w - 1.6, beside a forced f: it folds where p > 0, at w = 1.6 -+ 2 (p/3)^(3/2)."""

    p: jax.Array = parameter("1", -1.0, 1.0, "bend")

    def __call__(self, tau, y, speed):
        return speed - 1.6 - y[0] ** 3 + self.p * y[0], jnp.sin(tau) - y[1]


def test_a_fold_that_comes_into_an_open_range():
    """The stable orbit of the upper end folds there; another one, at the lower end, is no part of it."""
    space = DesignSpace.of(jc.ForcedSystem(Bent(p=-0.5), dimension=2), {"p": (-1.0, 1.0)})
    found = OperatingRange(space, (1.2, 2.4)).margins(np.array([0.8]))
    assert found["lower margin"].value == pytest.approx(100 * (1 - (1.6 - 2 * 0.2**1.5) / 1.2))
    assert found["upper margin"].value == pytest.approx(100)


REFUSED = [
    (dict(operating=(2.0, 1.2)), "`operating` must be two positive speeds, ascending, but are 2 and 1.2"),
    (dict(vary={"z": (0.0, 1.0)}), "`z` must be one of x, y, d, k, s, r"),
    (dict(vary={"x": (1.0, 1.0)}), "Bounds of `x` must ascend, but 1.0 and 1.0 were given"),
    (dict(search="newton"), "`search` must be one of slsqp, augmented, but 'newton' was given"),
    (dict(objective="noise"), "`objective` must be one of cost, width, but 'noise' was given"),
    (dict(cost={"z": Price(1.0, 1.0)}), "`cost` must name parameters of the design, but has 'z'"),
    (dict(tolerance={"x": Tolerance.balanced(2.5, 100.0)}), "`tolerance` of x is its whole range"),
    (dict(tolerance={"x": Tolerance(0.1, -0.1)}), "`tolerance` of x must have a lower end below its upper end"),
    (dict(operating=(2.7, 3.0)), "must have a stable orbit somewhere in its operating range, 26 to 29 rpm"),
]


@pytest.mark.parametrize("changed, sentence", REFUSED)
def test_refusals(changed, sentence):
    settings = dict(operating=OPERATING, vary=VARY, keep=KEEP, cost=cost, check=0) | changed
    with pytest.raises(ValueError, match=sentence) as raised:
        jc.design_for(window(), **settings)
    assert str(raised.value).endswith(".") and ". " not in str(raised.value)


def test_margins_that_cannot_be():
    for margin, sentence in ((50.0, "below 50 per cent, but 50 was"), (-1.0, "at least 0 and finite, but -1 was")):
        with pytest.raises(ValueError, match=f"`margin` must be {sentence}"):
            Requirements(margin=margin)
