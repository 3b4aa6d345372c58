"""Commands about periodic orbits and what bounds them: zones, bifurcations, gradients, maps."""

import dataclasses
from functools import partial
from typing import Annotated, Any

from .answer import Answer, drawn
from .options import (
    Case,
    Count,
    Discard,
    First,
    FromOne,
    FromTwo,
    FromZero,
    Last,
    Load,
    OptionalCount,
    OptionalSpeed,
    OptionalText,
    OptionalTwo,
    Points,
    Quick,
    RunOptions,
    Seed,
    ShowOptions,
    StepOptions,
    SweepOptions,
    number,
)
from .speed_commands import chances, counted, require_some, swept


def zones(
    case: Case,
    *,
    first: First = 2500.0,
    last: Last = 27500.0,
    count: Count = None,
    load: Load = None,
    draws: FromZero = 64,
    seed: Seed = 0,
    quick: Quick = False,
    run: SweepOptions = SweepOptions(),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Chaotic zones beside the zones without a stable synchronous orbit, with exact edges and their gradients.

    Of a bearing with its rollers stretches of speed with the same motion; of a file with ranges chances of chaos.

    Args:
        draws: Draws from values that the file knows within ranges only; 0 takes the best guesses as if they were known.
    """
    from .. import show as shown
    from ..analysis import zones as chaotic_zones
    from ..orbits import explain, loss_zones, synchronous_orbits
    from .speed_commands import said_of, zone_tables
    from .subject import read_case

    subject = read_case(case, load)
    if subject.unknowns and draws:
        return chances(subject, subject.range(first, last, count or 40), draws, seed, run, show)
    speeds = subject.range(first, last, count or subject.usual(251, 13))
    found, answer = swept(subject, speeds, run, show)
    if subject.reports_means:
        return answer
    model, method = subject.model, run.method
    with show.computing(f"synchronous orbits of {subject.name}") as progress:
        orbits = synchronous_orbits(model, speeds[0], speeds[-1], settled=found, method=method, progress=progress)
        loss = loss_zones(orbits)
        explained = explain(chaotic_zones(found), orbits, model, method)
        slopes = {} if quick else shown.edge_slopes(model, loss, explained, method)
    tables = [
        *zone_tables(subject, found, explained.zones),
        shown.loss_table(subject.name, orbits, loss, subject.published, subject.beside),
        *([shown.elasticities_table(subject.name, slopes, subject.beside)] if slopes else []),
    ]
    notes = [
        *shown.source_notes(explained),
        *shown.contact_notes(model, loss.edges, method),
        *shown.unsettled_notes(orbits),
        *answer.notes,
    ]
    return dataclasses.replace(answer, sentence=said_of(found, explained.zones), tables=tables, notes=notes)


def _searched(
    subject: Any, first: float, last: float, count: int | None, discard: int | None, method: Any, show: ShowOptions
) -> tuple[Any, Any]:
    """The synchronous orbits over speed, and the zones without a stable one.

    **Raises:** `NoResult` if there are none.
    """
    from .._errors import NoResult
    from ..orbits import loss_zones, synchronous_orbits

    low, high = subject.range(first, last, 2)
    length = {name: value for name, value in (("count", count), ("discard", discard)) if value is not None}
    with show.computing(f"synchronous orbits of {subject.name}") as progress:
        found = synchronous_orbits(subject.model, low, high, **length, method=method, progress=progress)
    if not found.branches:
        between = f" between {found.lower_rpm:g} and {found.upper_rpm:g} rpm"
        require_some(found.sweep, between)
        what = f"No simulation{between} settled on a synchronous orbit"
        raise NoResult(f"{what}: try more --discard, or a larger --count.")
    return found, loss_zones(found)


def _require_edges(found: Any, loss: Any, what: str) -> None:
    """**Raises:** `NoResult` where there is no edge to do anything to."""
    from .._errors import NoResult

    if not loss.edges:
        between = f"between {found.lower_rpm:g} and {found.upper_rpm:g} rpm"
        raise NoResult(
            f"No zone without a stable synchronous orbit begins or ends {between}: there is no edge to {what}."
        )


def bifurcations(
    case: Case,
    *,
    first: First = 2500.0,
    last: Last = 27500.0,
    count: OptionalTwo = None,
    discard: Discard = None,
    steps: StepOptions = StepOptions(),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Synchronous orbits over speed: where they are stable, how they lose it, and the zones without one."""
    from .. import show as shown
    from ..show import branch_columns
    from .subject import read_case

    subject = read_case(case)
    subject.require_orbits("bifurcations")
    found, loss = _searched(subject, first, last, count, discard, steps.method, show)
    main = found.branches[0 if loss.principal is None else loss.principal.branch]
    span = f"{main.speed_rpm.min():.0f} to {main.speed_rpm.max():.0f} rpm"
    orbits = lambda ax: shown.orbit_diagram_with_branches(found.sweep, found.branches, 1, ax)
    circle = drawn(f"{subject.name}: multipliers, {span}", lambda ax: shown.multiplier_circle(main, ax), 7.0, 6.0)
    files = {
        "figure": (".png", drawn(f"{subject.name}: synchronous orbits", orbits, 10.0, 6.0)),
        "multipliers": ("_multipliers.png", circle),
        "data": (".csv", branch_columns(found.branches)),
    }
    tables = [
        shown.loss_table(subject.name, found, loss, subject.published, subject.beside),
        shown.stretch_table(subject.name, found, subject.beside),
        shown.edge_table(found, loss, subject.beside),
    ]
    notes = [
        *shown.coexisting_notes(loss),
        *shown.contact_notes(subject.model, loss.edges, steps.method),
        *shown.unsettled_notes(found),
        f"Further bifurcations, on unstable parts: {len(found.points) - len(found.edges)} (listed by --json)",
        f"Settled orbits that are on no branch: {found.missed}",
    ]
    without = ", ".join(map(shown.zone_words, loss.zones)) or "none"
    said = f"The synchronous orbit is stable in {len(found.stretches)} ranges of speed; zones without it: {without}."
    return Answer(said, tables, notes, shown.orbits_document(found, loss), subject, files)


def gradient(
    case: Case,
    *,
    first: First = 2500.0,
    last: Last = 27500.0,
    count: OptionalTwo = None,
    discard: Discard = None,
    lasting: bool = False,
    zone: FromZero = 0,
    speed: OptionalSpeed = None,
    load: Load = None,
    by: tuple[str, ...] = (),
    designs: FromTwo = 64,
    spread: Annotated[float, number("be above 0 and at most 0.3", lambda x: 0 < x <= 0.3)] = 0.05,
    starts: FromOne = 2,
    revolutions: OptionalCount = None,
    chaos: bool = False,
    seed: Seed = 0,
    steps: StepOptions = StepOptions(),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Derivatives by every parameter: of the edges of the synchronous orbit and of the widths of zones.

    With --lasting of the edges of zones of lasting chaos; with --speed of means at one speed, such as slip, wear and
    power of a bearing with its rollers. Those have standard errors.

    Args:
        lasting: Of zones of chaos that lasts, by survival regression (minutes).
        zone: With --lasting: number of the zone, as `jaxcage sweep` counts them; 0 takes all.
        by: With --lasting or --speed: parameters, of which several joined by + change together.
        designs: With --lasting or --speed: designs around this one from which slopes are estimated.
        spread: With --speed: relative size of the changes of the parameters.
        starts: With --speed: initial states of each design.
        revolutions: With --speed: revolutions observed.
        chaos: With --speed: the mean slope of the largest Lyapunov exponent as well.
    """
    from .. import show as shown
    from .._errors import InputError, NoResult
    from ..orbits import sensitivities, width
    from .subject import read_case

    subject = read_case(case, load)
    model = subject.model
    if speed is not None or subject.reports_means:
        if speed is None:
            raise InputError('Option --speed must be given for a bearing, e.g. --speed "10000 rpm shaft".')
        length = {"discard": discard, "revolutions": revolutions, "starts": starts, "tolerance": steps.tolerance}
        given = {"designs": designs, "spread": spread, "seed": seed}
        return _of_means(subject, subject.speed(speed), by, length, given, chaos, show)
    if lasting:
        return _of_lasting(
            subject, subject.range(first, last, count or 251), zone, by, designs, seed, steps.method, show
        )
    if by or zone:
        raise InputError("Options --by and --zone go with --lasting, and --by with --speed.")
    found, loss = _searched(subject, first, last, count, discard, steps.method, show)
    _require_edges(found, loss, "differentiate")
    with show.computing(f"gradients of {subject.name}"):
        edges = sensitivities(model, loss.edges, method=steps.method)
    trusted = {name: edge for name, edge in edges.items() if edge.trusted}
    if not trusted:
        reasons = ", ".join(f"{name}: {edge.status}" for name, edge in edges.items())
        raise NoResult(f"No edge is a function of the design here ({reasons}): try more --steps.")
    ends = [trusted.get(f"zone 1 {end}") for end in ("onset", "exit")]
    wide = [width(*ends, "zone 1 width")] if all(ends) else []  # pyright: ignore[reportArgumentType]
    each = [*wide, *trusted.values()]
    bars = lambda ax: shown.elasticity_bars(shown.to_be_turned(model, each), ax)
    figure = drawn(f"{subject.name}: elasticities of the edges", bars, 9.0, 2.2 + 1.2 * len(each))
    tables = [
        shown.elasticities_table(subject.name, edges, subject.beside),
        shown.width_table(f"Widths of the synchronous-loss zones of {subject.name}", edges, shown.FIRST),
        *(shown.gradient_table(subject.name, model, s) for s in each),
    ]
    name, edge = max(trusted.items(), key=lambda item: abs(item[1].elasticity["guidance_gap"]))
    slope = edge.elasticity["guidance_gap"]
    said = f"1 % more guidance gap moves {name}, at {edge.value_rpm:.0f} rpm, by {slope:+.2f} %, more than the other edges."
    document = {"width": shown.slope_record("zone 1", wide[0]) if wide else None}
    return Answer(said, tables, shown.missing_notes(edges), document, subject, {"figure": (".png", figure)})


def _of_lasting(
    subject: Any, speeds: Any, zone: int, by: tuple[str, ...], designs: int, seed: int, method: Any, show: ShowOptions
) -> Answer:
    """Derivatives of edges and widths of zones of lasting chaos, by survival regression."""
    from .. import show as shown
    from .._errors import ArgumentError, InputError, NoResult
    from .._parameters import parameters
    from ..analysis import zones as chaotic_zones
    from ..design import lasting_edges
    from ..lanes import sweep as run_sweep

    names = by or shown.FIRST
    known = [name for name, value in parameters(subject.model).items() if float(value)]
    if wrong := [name for name in names if name not in known]:
        raise InputError(f"Option --by must name parameters of {subject.name} that are not 0, but has '{wrong[0]}'.")
    with show.computing(f"lasting chaos of {subject.name}") as progress:
        found = run_sweep(subject.model, speeds, method=method, progress=partial(progress, "sweep"))
        require_some(found)
        zones, horizon = chaotic_zones(found).zones, found.attrs["horizon"]
        if not zones:
            raise NoResult(f"No chaos lasts beyond {horizon} revolutions: there is no zone to differentiate.")
        if zone > len(zones):
            raise InputError(f"Option --zone must be at most {len(zones)}, the zones of lasting chaos, but is {zone}.")
        edges, notes = {}, []
        for i, each in enumerate(zones, start=1):
            if zone not in (0, i):
                continue
            given = {"names": names, "designs": designs, "seed": seed, "method": method}
            try:
                ends = lasting_edges(subject.model, each, **given, progress=partial(progress, f"edges of zone {i}"))
            except ArgumentError as error:
                notes.append(f"Zone {i} is left out: {error}")
                continue
            edges |= {f"zone {i} {end}": edge for end, edge in ends.items()}
    if not edges:
        raise NoResult(" ".join(notes) or "All zones are open at both ends: there is no edge to differentiate.")
    tables = [
        shown.lasting_table(subject.name, edges, horizon, subject.beside),
        shown.width_table(f"Widths of {subject.name} between mean lives of {horizon} revolutions", edges, names),
    ]
    said = (
        f"{len(edges)} edges at which the mean life of chaos passes {horizon} revolutions; errors are standard errors."
    )
    return Answer(said, tables, notes, {"horizon": horizon}, subject)


def _of_means(
    subject: Any, speed: float, by: tuple[str, ...], length: Any, given: Any, chaos: bool, show: ShowOptions
) -> Answer:
    """Derivatives of the means of a run at one speed, from pairs of designs around the given one."""
    import numpy as np

    from .. import show as shown
    from ..design import DIRECTIONS, STATISTICS, Runs, mean_gradient

    usual = {"discard": 20, "revolutions": 40, "tolerance": 1e-4, "starts": 2}
    length = usual | {name: value for name, value in length.items() if value is not None}
    statistics = (*STATISTICS, "exponent") if chaos else STATISTICS
    with show.computing(f"gradient {subject.name}") as progress:
        runs = Runs(speed, **length, blocks=2, exponents=int(chaos), progress=partial(progress, "designs"))
        found = mean_gradient(subject.model, runs, statistics, directions=by or DIRECTIONS, **given)
    title = f"{subject.name}, {subject.at(speed)}"
    pairs = [
        (abs(x), n, d, x)
        for n, each in found.statistics.items()
        for d, x in zip(each.directions, each.elasticity)
        if np.isfinite(x)
    ]
    _, name, direction, most = max(pairs)
    said = f"1 % more {direction.replace('_', ' ')} changes {name} by {most:+.2f} %, more than any other mean and parameter."
    notes = [
        f"{found.pairs} pairs of designs within ±{100 * found.spread:g} %; left out, as they failed: {found.failed}; "
        f"inaccurate lanes: {found.inaccurate}"
    ]
    if drifting := [n for n, each in found.statistics.items() if not each.settled]:
        notes.append(f"Not settled, so that more --discard may change it: {', '.join(drifting)}")
    if absent := [n for n, each in found.statistics.items() if not np.any(each.value)]:
        notes.append(f"Zero in every run: {', '.join(absent)}")
    document = (
        subject.both(speed) | {n: getattr(found, n) for n in ("pairs", "failed", "inaccurate", "spread")} | length
    )
    files = {"figure": (f"_{subject.both(speed)['speed_rpm']:g}rpm.png", shown.statistic_bars(found, title))}
    return Answer(said, shown.mean_gradient_tables(title, found), notes, document, subject, files)


def map_(
    case: Case,
    *,
    x: str = "speed",
    y: OptionalText = None,
    first: First = 2500.0,
    last: Last = 27500.0,
    lower: OptionalText = None,
    upper: OptionalText = None,
    points: Points = None,
    speed: OptionalSpeed = None,
    starts: FromOne = 1,
    persist: FromZero = 0,
    no_points: bool = False,
    no_curves: bool = False,
    run: RunOptions = RunOptions(),
    show: ShowOptions = ShowOptions(),
) -> Answer:
    """Stability map over two parameters: labels and the largest exponent, quantities of a bearing, and edges on top.

    Args:
        x: Parameter across: speed, or any parameter of the model.
        y: Parameter upwards; guidance_gap if left out, of a bearing with its rollers its load.
        lower: Lowest value of y, in SI units or with a unit, e.g. "0.4 mm"; 0.8 of its value if left out.
        upper: Highest value of y; 1.25 of its value if left out.
        points: Grid of points at which lanes are run, e.g. 300x300.
        starts: Initial states at each point.
        persist: Revolutions that chaos must outlast to count.
        no_points: Follow the edges of the synchronous orbit only.
        no_curves: Do not follow the edges of the synchronous orbit.
    """
    import numpy as np

    from .. import show as shown
    from .._errors import ArgumentError, InputError, NoResult
    from .._parameters import parameter_info, parameters
    from ..files import to_si
    from ..lanes import label_map
    from .subject import RPM, read_case

    subject = read_case(case)
    model, known = subject.model, list(parameters(subject.model))
    y = y or subject.usual("guidance_gap", "load")
    for option, given, allowed in (("--y", y, known), ("--x", x, [shown.SPEED, *known])):
        if given not in allowed:
            raise InputError(f"Option {option} must be one of {', '.join(allowed)}, but '{given}' was given.")
    if x == y:
        raise InputError(f"Options --x and --y must be two different parameters, but both are {x}.")
    if (speed is None) == (x != shown.SPEED) and not no_points:
        raise InputError(
            f"Option --speed must be given for a map over {x}."
            if x != shown.SPEED
            else "Option --speed goes with another --x."
        )
    ends = {}
    for end, text in (("lower", lower), ("upper", upper)):
        try:
            ends |= {} if text is None else {end: to_si(text, parameter_info(model)[y].unit)}
        except ValueError as error:
            raise ArgumentError(end, said=f"{error}.") from error
    up = shown.parameter_axis(model, y, **ends)
    across = (
        shown.Axis(x, *subject.range(first, last, 2), "rad/s") if x == shown.SPEED else shown.parameter_axis(model, x)
    )
    curves, refused, found, tables, document = (
        [],
        {},
        None,
        [],
        {"x": x, "y": y, "x_range": across.range, "y_range": up.range},
    )
    if not no_points:
        columns, rows = points or subject.usual((50, 12), (13, 8))
        grid = {x: np.linspace(across.lower, across.upper, columns)}, {y: np.linspace(up.lower, up.upper, rows)}
        settings = {name: value for name, value in run.settings.items() if value is not None}
        usual = (
            {"discard": 1000, "revolutions": 100, "blocks": 20}
            if not subject.reports_means
            else {"discard": 20, "revolutions": 20}
        )
        at = None if speed is None else subject.speed(speed)
        with show.computing(f"map {subject.name}") as progress:
            found = label_map(
                model, *grid, speed=at, starts=starts, persist=persist, stage=progress, **usual | settings
            )
        require_some(found)
        document |= {"points": [columns, rows], "labels": counted(found), "exponents": shown.top_exponent(found)}
        tables.append(shown.shares_table(f"Points of {subject.name} over {x} and {y}", "label", document["labels"]))
    if not (no_curves or subject.reports_means):
        try:
            orbits, loss = _searched(
                subject, first, last, None, 1000 if run.discard is None else run.discard, run.method, show
            )
            _require_edges(orbits, loss, "follow")
            with show.computing(f"edges of {subject.name}") as progress:
                curves, refused = shown.follow_edges(model, loss.edges, across, up, run.method, progress)
            if not curves:
                raise NoResult(f"No edge could be followed ({'; '.join(f'{n}: {why}' for n, why in refused.items())}).")
        except NoResult as error:
            if found is None:
                raise
            refused = {"edges": str(error).rstrip(".")}
    files: dict[str, Any] = {} if found is None else {"data": (f"_{x}_{y}.zarr", found)}
    if curves:
        tables.insert(0, shown.curves_table(f"Edges of {subject.name} over {x} and {y}", curves, across, up))
        joined = lambda parts: np.concatenate([np.asarray(part) for part in parts])
        data = {"curve": joined(np.full(c.x_value.size, i) for i, c in enumerate(curves, start=1))}
        data |= {
            axis.head: axis.shown(joined(getattr(c, f"{n}_value") for c in curves))
            for n, axis in (("x", across), ("y", up))
        }
        files["curve_data"] = f"_{x}_{y}.csv", data | {"genuine": joined(c.genuine for c in curves)}
    if subject.reports_means:
        files["figure"] = f"_{x}_{y}.png", shown.map_figure(found, title=f"{subject.name} over {x} and {y}")
    else:
        draw = lambda ax: shown.stability_map(curves, ax, found=found, unit=up.unit)
        files["figure"] = f"_{x}_{y}.png", drawn(f"{subject.name}: edges and largest exponent", draw, 10.0, 6.0)
    document |= {"refused": refused, "speed_rpm": None if speed is None else subject.speed(speed) * RPM}
    notes = [f"Not followed: {name} ({why})" for name, why in refused.items()]
    most = "" if found is None else f"; most points are {max(document['labels'], key=document['labels'].__getitem__)}"
    said = f"{len(curves)} edges were followed over {x} and {y}{most}."
    return Answer(said, tables, notes, document, subject, files)
