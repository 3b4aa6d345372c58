"""A grid of labels of which only those near a change of label are computed.

A coarse lattice of points comes first. Then, stride by stride, every cell in which known labels differ is cut into
four, and at coarse strides its neighbours are too. Labels on the rim of a cell that has been cut count for the cells
next to it, so that an edge is followed to wherever it leads. Where more than half of the cells around one change there
is speckle, as where chaotic transients end sooner or later, and no edge to follow: every other point has to do there.
What no lattice point of the coarse picture, nor a cell beside an edge, comes across stays unseen: islands narrower than
the first stride may be missed.
"""

import dataclasses
from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Int

from .._errors import ArgumentError


Points = Int[np.ndarray, "points 2"]
Evaluate = Callable[[Points], Int[np.ndarray, " points"]]
"""Places in the grid -> their labels, as whole numbers."""
UNKNOWN = np.iinfo(np.int32).min
NEIGHBOURS_ABOVE = 4
"""Cells beside a change are cut too at strides above this one, which meets narrow things there."""
CROWD, CROWDED = 7, 0.5
"""Of CROWD x CROWD cells with two points a side, the share with a change from which on they are speckle."""


@dataclasses.dataclass(frozen=True)
class AdaptiveGrid:
    """Labels on a grid, as far as they have been computed."""

    label: Int[np.ndarray, "x y"]
    """`UNKNOWN` where none has been computed."""
    stride: int
    """Distance of the points between which changes have been looked for: 1 once it is done."""
    complete: bool
    """False if there were not points enough to follow every edge down to neighbouring points."""

    @property
    def known(self) -> Bool[np.ndarray, "x y"]:
        """Points that have been computed."""
        return self.label != UNKNOWN

    @property
    def points(self) -> int:
        """Number of points that have been computed."""
        return int(np.sum(self.known))

    @property
    def nearest(self) -> tuple[Int[np.ndarray, "x y"], Int[np.ndarray, "x y"]]:
        """For each point, the place of the nearest one that has been computed."""
        from scipy.ndimage import distance_transform_edt

        places = distance_transform_edt(~self.known, return_distances=False, return_indices=True)
        across, upward = np.asarray(places)
        return across, upward

    @property
    def filled(self) -> Int[np.ndarray, "x y"]:
        """Labels, those unknown taken from the nearest point that is known."""
        return self.label[self.nearest]


def refine(
    evaluate: Evaluate,
    shape: tuple[int, int],
    *,
    first: int | None = None,
    most: int | None = None,
    everywhere: bool = False,
    report: Callable[[AdaptiveGrid], None] | None = None,
) -> AdaptiveGrid:
    """Find where labels change on a grid of `shape` from as few of its points as that takes.

    **Arguments:** labels of given points; points across and upwards; stride of the coarse picture, a power of 2 (by
    default about half the square root of the longer side); how many points may be computed at most; whether to cut
    every cell, from coarse to fine, up to the full grid; called with the coarse picture and after every stride.

    **Returns:** `AdaptiveGrid`.

    **Raises:** `ValueError` for a grid of less than 2 x 2 points, or a stride that is no power of 2.
    """
    stride = first_stride(shape) if first is None else first
    if min(shape) < 2:
        raise ArgumentError("shape", said=f"must be at least 2 x 2, but {shape[0]} x {shape[1]} was given.")
    if stride < 1 or stride & (stride - 1):
        raise ArgumentError("first", said=f"must be a power of 2, but {stride} was given.")
    label = np.full(shape, UNKNOWN, dtype=np.int32)
    left = label.size if most is None else most

    def compute(wanted: Bool[np.ndarray, "x y"]) -> bool:
        """Whether there were points enough."""
        nonlocal left
        points = np.argwhere(wanted & (label == UNKNOWN))
        if len(points) > left:
            return False
        if len(points):
            label[tuple(points.T)] = evaluate(points)
            left -= len(points)
        return True

    enough = compute(_lattice(shape, stride))
    while True:
        found = AdaptiveGrid(label.copy(), stride, enough and stride == 1)
        if report is not None and found.points:
            report(found)
        if stride == 1 or not enough:
            return found
        enough = compute(_lattice(shape, stride // 2)) if everywhere else _cut_cells(label, stride, compute)
        stride = stride // 2 if enough else stride


def first_stride(shape: tuple[int, int]) -> int:
    """Stride of the coarse picture: on 300 points 8, on 1000 points 16."""
    return 2 ** max(0, round(np.log2(np.sqrt(max(shape)) / 2)))


def _cut_cells(label: Int[np.ndarray, "x y"], stride: int, compute: Callable[[np.ndarray], bool]) -> bool:
    """Cut cells until no cell left whole has two labels on it. **Returns:** whether there were points enough."""
    lines = _lines(label.shape, stride)
    finer = _lattice(label.shape, stride // 2)
    cut = np.zeros([len(x) - 1 for x in lines], dtype=bool)
    while True:
        wanted = changes(label, lines)
        if stride > NEIGHBOURS_ABOVE:
            wanted = _with_neighbours(wanted)
        if stride == 2:
            wanted &= ~_speckled(wanted)
        if not np.any(wanted & ~cut):
            return True
        cut |= wanted
        if not compute(finer & _points_of(cut, lines, label.shape)):
            return False


def _lines(shape: tuple[int, ...], stride: int) -> list[np.ndarray]:
    """Places of a lattice's lines along each axis; the last point of the axis is always one."""
    return [np.unique(np.append(np.arange(0, n, stride), n - 1)) for n in shape]


def _lattice(shape: tuple[int, ...], stride: int) -> Bool[np.ndarray, "x y"]:
    there = np.zeros(shape, dtype=bool)
    there[np.ix_(*_lines(shape, stride))] = True
    return there


def changes(label: Int[np.ndarray, "x y"], lines: list[np.ndarray] | None = None) -> Bool[np.ndarray, "i j"]:
    """Cells with two different known labels inside or on the rim; by default those between neighbouring points."""
    lines = _lines(label.shape, 1) if lines is None else lines
    known = label != UNKNOWN
    lowest = np.where(known, label, np.iinfo(np.int32).max)
    highest = np.where(known, label, np.iinfo(np.int32).min)
    for axis, line in enumerate(lines):
        end = np.take(lowest, line[1:], axis), np.take(highest, line[1:], axis)
        lowest = np.minimum(np.minimum.reduceat(lowest, line[:-1], axis), end[0])
        highest = np.maximum(np.maximum.reduceat(highest, line[:-1], axis), end[1])
    return lowest < highest


def _with_neighbours(cells: Bool[np.ndarray, "i j"]) -> Bool[np.ndarray, "i j"]:
    from scipy.ndimage import binary_dilation

    return binary_dilation(cells, np.ones((3, 3), dtype=bool))


def _speckled(cells: Bool[np.ndarray, "i j"]) -> Bool[np.ndarray, "i j"]:
    from scipy.ndimage import uniform_filter

    return uniform_filter(cells.astype(float), CROWD, mode="constant") > CROWDED


def _points_of(
    cells: Bool[np.ndarray, "i j"], lines: list[np.ndarray], shape: tuple[int, ...]
) -> Bool[np.ndarray, "x y"]:
    """Points inside and on the rim of `cells`."""
    x, y = (np.repeat(np.arange(len(line) - 1), np.diff(line)) for line in lines)
    inside = cells[np.ix_(x, y)]
    found = np.zeros(shape, dtype=bool)
    for i in (0, 1):
        for j in (0, 1):
            found[i : i + inside.shape[0], j : j + inside.shape[1]] |= inside
    return found


def found_share(grid: AdaptiveGrid, full: Int[np.ndarray, "x y"]) -> float:
    """Of the cells in which labels of the `full` grid change, the share with a change of `filled` in them or beside."""
    there = changes(full)
    near = _with_neighbours(changes(grid.filled))
    return float(np.mean(near[there])) if np.any(there) else 1.0
