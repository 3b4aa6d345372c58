"""Adaptive grids of labels: what they find of fields that are known everywhere, and with how many points."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc
from jaxcage.studies import LABELS, PENDING, UNKNOWN, AdaptiveGrid, changes, found_share, kinds, refine


SIDE = 300
X, Y = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE), indexing="ij")


def tongues() -> np.ndarray:
    """Three wedges that come to a point, each with its own label."""
    wedges = [(0.2, 0.1, 0.3), (0.5, 0.05, 0.0), (0.8, 0.2, 0.5)]
    parts = [(np.abs(X - c) < w * np.maximum(0, Y - y)) * (i + 1) for i, (c, w, y) in enumerate(wedges)]
    return np.sum(parts, axis=0)


def zone_with_windows() -> np.ndarray:
    """A zone between two slanting edges, cut by two calm windows about four cells wide."""
    zone = (X - 0.45 * Y > 0.2) & (X - 0.6 * Y < 0.5)
    for c in (0.33, 0.45):
        zone &= ~(np.abs(X - 0.5 * Y - c) < 0.004 + 0.006 * Y)
    return zone.astype(int)


FIELDS: dict[str, Callable[[], np.ndarray]] = {
    "disc": lambda: ((X - 0.5) ** 2 + (Y - 0.5) ** 2 < 0.09).astype(int),
    "tongues": tongues,
    "bands": lambda: (np.sin(18 * X + 4 * np.sin(3 * Y)) > 0.3).astype(int),
    "a line three cells wide": lambda: (np.abs(X - 0.5 - 0.2 * np.sin(7 * Y)) < 1.5 / SIDE).astype(int),
    "windows": zone_with_windows,
}


@pytest.mark.parametrize("name", FIELDS)
def test_changes_of_a_grid_of_300_are_found_with_few_points(name: str):
    """99 % of the full grid's label-change cells to within one cell, with 15 % of its points."""
    field = FIELDS[name]()
    asked = np.zeros(field.shape, dtype=int)

    def look(points: np.ndarray) -> np.ndarray:
        np.add.at(asked, tuple(points.T), 1)
        return field[tuple(points.T)]

    grid = refine(look, field.shape)
    assert np.max(asked) == 1 and np.sum(asked) == grid.points  # no point is computed twice
    assert np.array_equal(grid.label[grid.known], field[grid.known])
    assert grid.points <= 0.15 * field.size
    assert found_share(grid, field) >= 0.99
    assert np.mean(grid.filled != field) < 1e-3
    assert grid.complete and grid.stride == 1


def test_what_is_missed_is_what_the_coarse_picture_cannot_see():
    """An island of three cells away from every edge and lattice point is not found; beside an edge it is."""
    field = (X > 0.5).astype(int)
    field[20 + 1 : 20 + 4, 33:36] = 1
    field[139:142, 199:202] = 1  # between the lattice's lines too; 149 is the last place below the edge
    seen: list[AdaptiveGrid] = []
    grid = refine(lambda p: field[tuple(p.T)], field.shape, report=seen.append)
    assert seen[0].stride == 8 and np.all(grid.filled[21:24, 33:36] == 0)
    assert np.array_equal(grid.filled[130:], field[130:])


def test_speckle_is_seen_but_not_followed():
    """Where labels change at every other point there are no edges to follow: every other point shows that. If there are
    fewer points than that takes, they are said not to have been enough."""
    field = np.random.default_rng(0).integers(0, 2, (64, 64))
    seen = refine(lambda p: field[tuple(p.T)], field.shape)
    assert seen.complete and seen.points <= 0.35 * field.size  # in its corners fewer than half of the cells around are
    assert found_share(seen, field) >= 0.95
    few = refine(lambda p: field[tuple(p.T)], field.shape, most=600)
    assert few.points <= 600 and not few.complete and few.stride > 1


def test_pictures_come_early_and_refine():
    field = tongues()
    seen: list[AdaptiveGrid] = []
    refine(lambda p: field[tuple(p.T)], field.shape, report=seen.append)
    assert [g.stride for g in seen] == [8, 4, 2, 1]
    assert seen[0].points == 39 * 39  # every eighth of 300 and the last
    shares = [found_share(g, field) for g in seen]
    assert all(np.all(b.known[a.known]) for a, b in zip(seen, seen[1:], strict=False))
    assert shares[0] < 0.75 and shares[-1] == 1.0


def test_everywhere_is_the_full_grid():
    field = tongues()[:50, :41]
    grid = refine(lambda p: field[tuple(p.T)], field.shape, everywhere=True)
    assert np.array_equal(grid.label, field) and grid.points == field.size and grid.complete


def test_changes_are_cells_with_two_labels():
    label = np.array([[0, 0, 0], [0, 1, UNKNOWN], [0, 0, UNKNOWN]])
    assert np.array_equal(changes(label), [[True, True], [True, True]])
    label[1, 1] = UNKNOWN
    assert not np.any(changes(label))


@pytest.mark.parametrize(
    "shape, options, words",
    [((1, 5), {}, "at least 2 x 2"), ((5, 5), {"first": 3}, "power of 2"), ((5, 5), {"first": 0}, "power of 2")],
)
def test_impossible_grids_are_refused(shape: tuple[int, int], options: dict, words: str):
    with pytest.raises(ValueError, match=words):
        refine(lambda p: p[:, 0], shape, **options)


class Ueda(eqx.Module):
    """x'' + 0.05 x' + x^3 = force cos t."""

    force: jax.Array

    def __call__(self, tau, q, v, speed):
        del speed
        (x,), (u,) = q, v
        return (-0.05 * u - x**3 + self.force * jnp.cos(tau),)


@pytest.mark.wide
def test_map_of_a_system_agrees_with_a_sweep():
    """Labels of every computed point are those of sweeps; what a point counts as follows from all of its starts."""
    make = lambda force: jc.ForcedOscillator(Ueda(jnp.array(force)), coordinates=1)
    speeds, forces = np.linspace(0.9, 1.4, 9), np.linspace(4.0, 8.0, 8)
    length = dict(discard=60, revolutions=60, blocks=6, method=jc.method("rodas4", steps=32))
    pictures: list[jc.studies.LabelMap] = []
    found = jc.label_map(
        make(7.5), {"speed": speeds}, {"force": forces}, starts=2, first=4, report=pictures.append, **length
    )
    assert [p.grid.stride for p in pictures] == [4, 2, 1]
    assert np.sum(pictures[0].grid.known) == 3 * 3
    assert np.array_equal(found.label == PENDING, np.repeat(~found.grid.known[..., None], 2, axis=2))
    starts = [tuple(float(c) for c in s) for s in make(7.5).starts(1.0)[:2]]
    same, near = 0, 0
    for j in (0, 7):
        swept = jc.sweep(make(forces[j]), speeds, starts=starts, keep=16, confirm=False, horizon=0, **length)
        known = found.grid.known[:, j]
        mine = np.array(LABELS)[found.label[known, j]]
        periodic = np.char.startswith(swept.label[known], "periodic")
        assert np.array_equal(mine[periodic], swept.label[known][periodic])
        agree = mine == swept.label[known]
        assert np.mean(found.too_short[known, j][agree] == swept.too_short[known][agree]) > 0.9
        same, near = same + np.sum(mine == swept.label[known]), near + mine.size
    assert same >= 0.9 * near  # long chaotic lanes differ by rounding, and a few of their labels with them
    assert np.any(found.too_short) and "labels rest on too few revolutions" in str(found)
    assert 0 < np.sum(kinds(found.label) == 1) < found.grid.known.size
    assert np.array_equal(found.grid.label[found.grid.known], kinds(found.label)[found.grid.known])
    assert np.array_equal(found.kind[found.grid.known], found.grid.label[found.grid.known])


def test_speckle_beside_an_edge_leaves_the_edge_sharp():
    field = (X > 0.6).astype(int)
    field[:100] = np.random.default_rng(0).integers(0, 2, (100, SIDE))
    grid = refine(lambda p: field[tuple(p.T)], field.shape)
    assert np.array_equal(grid.filled[110:], field[110:])
    assert np.sum(grid.known[:100]) <= 0.3 * 100 * SIDE


@pytest.mark.wide
def test_chaos_must_persist_if_asked():
    """Starts found chaotic are judged again after more revolutions, all others stay as they were."""
    system = jc.ForcedOscillator(Ueda(jnp.array(7.5)), coordinates=1)
    x, y = {"speed": np.linspace(0.95, 1.15, 9)}, {"force": np.linspace(6.0, 8.0, 6)}
    length = dict(revolutions=60, blocks=6, method=jc.method("rk4", steps=64), starts=2, refine_by="everything")
    soon, late = (jc.label_map(system, x, y, discard=n, **length) for n in (20, 400))
    found = jc.label_map(system, x, y, discard=20, persist=400, **length)
    chaotic = soon.label == LABELS.index("chaotic")
    assert np.array_equal(found.label, np.where(chaotic, late.label, soon.label))
    assert np.array_equal(found.largest_exponent, np.where(chaotic, late.largest_exponent, soon.largest_exponent))
    died = chaotic & (found.label != LABELS.index("chaotic"))
    assert 0 < np.sum(died) < np.sum(chaotic)  # transients and attractors both
    with pytest.raises(ValueError, match="`persist` must be 0 or above the 20 revolutions discarded, but is 20"):
        jc.label_map(system, x, y, discard=20, persist=20, **length)


def test_what_a_point_counts_as():
    chaotic, failed, calm = (LABELS.index(name) for name in ("chaotic", "failed", "periodic-1"))
    label = np.array([[calm, calm], [calm, chaotic], [failed, chaotic], [failed, calm]])
    assert kinds(label).tolist() == [0, 1, 1, 2]
