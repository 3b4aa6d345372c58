"""The integration loop: whole revolutions of many lanes by an embedded explicit pair or Rodas4, as LLVM IR.

Each lane of a vector has its own phase, step size and revolution. When it has finished or failed, the next lane of a
queue, which all threads share, replaces it. Steps are controlled by the estimated error (PI controller), in units of
the system's scale, and end near abrupt changes of the law. At the end of a revolution the strobe state is stored,
tangent vectors are orthonormalised, and their growth is stored. The results of a lane depend neither on other lanes nor
on the number of threads. The mark of a lane that has ended is the code of its outcome plus one.
"""

from typing import Any

import numpy as np

from ..models import ESCAPE
from .ir import Code, Function, Value, is_variable, module, number
from .layout import REVOLUTION, Field, Layout, Tableau, fixed_numbers, layout_of, rates_arguments
from .outcomes import FINISHED, NOT_FINITE, OUTSIDE, STUCK, TOO_MANY
from .program import following
from .step_control import limited_step, next_step, squared_error, step_to_strobe


def march_ir(field: Field, pair: str, width: int) -> str:
    """Module of a system, whose function `march` runs the lanes of a queue until it is empty.

    `march(queue, lanes, revolutions, keep, settings, shared, loaded, stored, strobe, growth)`: queue holds the next
    lane, a stop flag, and the number of strobe states reached; settings are tolerance, largest step, smallest step;
    loaded and stored have a row of all lanes for each of the first rows of `layout_of`; strobe is (lanes, keep,
    recorded), a ring buffer; growth is (lanes, revolutions, tangents), squared lengths.
    """
    tableau = Tableau.named(pair)
    rows = layout_of(field, len(tableau.phase))
    made = [_prelude(field, rows, width)] if field.prelude else []
    rates = field.rates.code(field, rows, width) if hasattr(field.rates, "code") else _rates(field, rows, width)
    implicit = [_implicit(field, rows, width)] if tableau.implicit else []
    return module(*made, rates, *implicit, _loop(field, rows, tableau, width), _refill(rows, width))


def _made_wide(field: Field) -> list[bool]:
    """True for each result of the prelude that depends on a number that differs from lane to lane."""
    jaxpr = field.prelude.jaxpr
    wide = following(jaxpr.eqns, [v for v, each in zip(jaxpr.invars, field.wide, strict=True) if each])
    return [is_variable(v) and v in wide for v in jaxpr.outvars]


def _prelude(field: Field, rows: Layout, width: int) -> Function:
    """Code for everything that depends on the fixed numbers alone."""
    w = Code(width)
    results = w.program(field.prelude, fixed_numbers(w, field, rows, field.prelude, 0))
    for row, wide, v in zip(rows["made"], _made_wide(field), results, strict=True):
        w.put(row, v, wide)
    return w.function("prelude", "ptr noalias %memory, ptr noalias %shared")


def _rates(field: Field, rows: Layout, width: int) -> Function:
    """Code for the rates of state and tangents at `place`, stored at `out`."""
    w = Code(width)
    moved = [w.get(j, base="%place") for j in range(field.moving)]
    arguments = [Value("%phase", "double", True), *moved]
    fixed = fixed_numbers(w, field, rows, field.rates, len(arguments))
    made = [w.get(row, wide) for row, wide in zip(rows["made"], _made_wide(field), strict=True)]
    results = w.program(field.rates, [*arguments, *fixed, *made])
    for j, v in enumerate(results):
        w.put(j, v, base="%out")
    return w.function("rates", rates_arguments(w))


def _implicit(field: Field, rows: Layout, width: int) -> Function:
    """Code for an implicit step from the state in memory, with the new state in `stage` and its errors in `again`."""
    w = Code(width)
    assert field.step is not None
    moved = w.all(rows["state"])
    arguments = [Value("%phase", "double", True), Value("%step", "double", True), *moved]
    results = w.program(field.step, [*arguments, *fixed_numbers(w, field, rows, field.step, len(arguments))])
    for j, v in enumerate(results[: field.moving]):
        w.put(rows["stage"][0] + j, v)
    for j, v in enumerate(results[field.moving :]):
        w.put(rows["again"][0] + j, v)
    vector = w.type("double", True)
    return w.function("implicit", f"{vector} %phase, {vector} %step, ptr noalias %memory, ptr noalias %shared")


def _refill(rows: Layout, width: int) -> Function:
    """Code of `refill`, which stores lanes that have ended and loads lanes of the queue; true if any lane is left."""
    w = Code(width)
    lanes = Value("%lanes", "i64")
    of_lane = lambda base, row, lane: w.element(base, w.add(w.mul(row, lanes), lane))

    def renew(j: Value, alive: list[Value]) -> list[Value]:
        """Renew one lane of the vector."""
        mine = lambda row: w.element("%memory", w.add(w.mul(row, number(width)), j))
        place = mine(number(rows["lane"][0]))

        def leave() -> None:
            lane = w.convert("fptosi", w.load(place), "i64")
            keep = lambda row, _: w.store(w.load(mine(row)), of_lane("%stored", row, lane))
            w.when(w.compare("ge", lane, number(0)), lambda: w.loop(number(rows["mark"].stop), [], keep))
            (begun,) = w.when(_goes_on(w), enter, otherwise=[number(-1.0)])
            w.store(begun, place)

        def enter() -> list[Value]:
            lane = w.add_atomically(w.element("%queue", 0, "i64"), number(1))
            some = w.compare("lt", lane, lanes)
            fetch = lambda row, _: w.store(w.load(of_lane("%loaded", row, lane)), mine(row))
            w.when(some, lambda: w.loop(number(rows["first_step"].stop), [], fetch))
            return [w.select(some, w.convert("sitofp", lane, "double"), number(-1.0))]

        w.when(w.compare("ne", w.load(mine(number(rows["mark"][0]))), number(0.0)), leave)
        return [w.simple("or", *alive, w.compare("ge", w.load(place), number(0.0)))]

    (alive,) = w.loop(number(width), [number(False)], renew)
    return w.function("refill", "ptr %memory, ptr %queue, i64 %lanes, ptr %loaded, ptr %stored", alive)


def _goes_on(w: Code) -> Value:
    """True if the stop flag is not set."""
    return w.compare("eq", w.load_atomically(w.element("%queue", 1, "i64")), number(0))


def _loop(field: Field, rows: Layout, tableau: Tableau, width: int) -> Function:
    """Code for the steps of a vector of lanes, with their control."""
    w = Code(width)
    n, moving, stages, span = field.dimension, field.moving, len(tableau.phase), field.span
    one, zero, marked = number(1.0), number(0.0), lambda code: number(code + 1.0)
    row = {name: rows[name][0] for name in rows if rows[name]}
    at_stage, total_rows = lambda i: row["rate"] + i * span, rows["made"].stop
    vector = w.type("double", True)

    def since_zero(phase: Value) -> Value:
        """Phase of the law; that of the loop restarts at each strobe state."""
        if not field.phased:
            return phase
        turn, k = w.get(row["turn"]), w.add(w.get(row["begin"]), w.get(row["revolution"]))
        half = w.mul(w.add(k, number(0.5)), w.mul(turn, number(1 / REVOLUTION)))
        begun = w.sub(w.mul(turn, k), w.mul(w.call("floor", half), number(REVOLUTION)))
        return w.add(begun, phase)

    def rates(phase: Value, place: int, out: int) -> None:
        phase = w.widened(since_zero(phase))
        w.line(f"call void @rates({w.typed(phase)}, ptr {w.at(place)}, ptr %memory, ptr %shared, ptr {w.at(out)})")

    def renew_rates(some: Value) -> None:
        """Rates at the present state, in the lanes where the mask holds."""
        rates(w.get(row["phase"]), row["state"], row["again"])
        new = lambda at: w.select(some, w.get(at(row["again"])), w.get(at(at_stage(0))))
        w.over(moving, (), lambda at, _: w.put(at(at_stage(0)), new(at)))

    w.line(f"%memory = alloca {vector}, i64 {total_rows}, align {max(64, width * 8)}")
    size = total_rows * width * 8
    w.line(f"call void @llvm.memset.p0.i64(ptr align 8 %memory, i8 0, i64 {size}, i1 false)")
    w.declarations.add("declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)")
    tolerance, largest, smallest = (w.load(w.element("%settings", k)) for k in range(3))
    total, kept = (w.convert("sitofp", Value(f"%{x}", "i64"), "double") for x in ("revolutions", "keep"))
    w.put(row["mark"], one)
    w.put(row["lane"], number(-1.0))
    w.line("br label %refill")

    w.line("refill:")
    w.line("%alive = call i1 @refill(ptr %memory, ptr %queue, i64 %lanes, ptr %loaded, ptr %stored)")
    w.line("br i1 %alive, label %begin, label %return")
    w.line("begin:")
    if field.prelude:
        w.line("call void @prelude(ptr %memory, ptr %shared)")
    renew_rates(w.compare("eq", w.get(row["first_step"]), zero))
    w.put(row["first_step"], one)
    w.line("br label %step")

    w.line("step:")
    phase, h, lane, mark = (w.get(row[x]) for x in ("phase", "step", "lane", "mark"))
    runs = w.both(w.compare("ge", lane, zero), w.compare("eq", mark, zero))
    arguments = lambda program, leading: [*leading, *fixed_numbers(w, field, rows, program, len(leading))]
    limited = h if field.abrupt is None else limited_step(w, field, rows, lambda: since_zero(phase), h)
    step, ends, halves = step_to_strobe(w, limited, w.sub(w.get(row["turn"]), phase))
    if tableau.implicit:
        at = w.typed(w.widened(since_zero(phase))), w.typed(w.widened(step))
        w.line(f"call void @implicit({at[0]}, {at[1]}, ptr %memory, ptr %shared)")
        rates(w.add(phase, step), row["stage"], at_stage(1))
    for i in () if tableau.implicit else range(1, stages):
        scaled = [(w.mul(step, number(a)), j) for j, a in enumerate(tableau.stages[i]) if a != 0.0]

        def argument(at: Any, _: Any, scaled: Any = scaled) -> None:
            terms = (w.mul(a, w.get(at(at_stage(j)))) for a, j in scaled)
            w.put(at(row["stage"]), w.add(w.get(at(row["state"])), *terms))

        w.over(moving, (), argument)
        rates(w.add(phase, w.mul(step, number(tableau.phase[i]))), row["stage"], at_stage(i))
    error = squared_error(w, field, rows, tableau, step, tolerance)
    fine = w.compare("le", error, one)
    moves = w.both(fine, runs)
    bits, last = w.log2(error), w.get(row["error"])
    proposed = next_step(w, tableau.order, step, limited, w.simple("or", ends, halves), fine, bits, last, largest)
    w.put(row["step"], w.select(runs, proposed, h))
    w.put(row["error"], w.select(moves, w.larger(bits, number(-16.0)), last))
    over = w.both(moves, ends)
    w.put(row["phase"], w.select(over, zero, w.select(moves, w.add(phase, step), phase)))
    taken = w.add(w.get(row["steps"]), w.select(runs, one, zero))
    w.put(row["steps"], taken)

    def accept(at: Any, size: list[Value]) -> list[Value]:
        old, first = w.get(at(row["state"])), w.get(at(at_stage(0)))
        w.put(at(row["state"]), w.select(moves, w.get(at(row["stage"])), old))
        w.put(at(at_stage(0)), w.select(moves, w.get(at(at_stage(stages - 1))), first))
        return [w.add(size[0], w.call("fabs", old), w.call("fabs", first))]

    (size,) = w.over(moving, [zero], accept)
    if field.excursion is not None:
        new = w.all(range(row["stage"], row["stage"] + n))
        watched = w.program(field.excursion, arguments(field.excursion, [zero, *new]))
    else:
        watched = [w.get(at_stage(stages - 1) + moving + k) for k in range(field.watched)]
    for k, x in enumerate(map(w.widened, watched)):
        peak = w.get(row["peak"] + k)
        w.put(row["peak"] + k, w.select(w.both(moves, w.compare("gt", x, peak)), x, peak))
    mark = w.select(w.both(moves, w.compare("gt", w.widened(watched[0]), number(ESCAPE))), marked(OUTSIDE), mark)
    refused = w.both(runs, w.negated(fine), w.compare("lt", proposed, smallest))
    finite = w.compare("lt", size, number(np.inf))
    mark = w.select(refused, w.select(finite, marked(STUCK), marked(NOT_FINITE)), mark)
    most = w.mul(w.get(row["most"]), w.add(w.get(row["revolution"]), one))
    mark = w.select(w.both(runs, w.compare("gt", taken, most)), marked(TOO_MANY), mark)
    w.put(row["mark"], mark)
    w.line(f"br i1 {w.any(over)}, label %over, label %check")

    w.line("over:")
    reached = w.call("ctpop", w.convert("zext", w.bits(over), "i64"))
    w.add_atomically(w.element("%queue", 2, "i64"), reached)
    w.line(f"br i1 {_goes_on(w)}, label %record, label %return")
    w.line("record:")
    revolution = w.get(row["revolution"])
    ring = w.sub(revolution, w.mul(kept, w.call("floor", w.div(w.add(revolution, number(0.5)), kept))))
    recorded = number(float(field.recorded))
    place = w.convert("fptosi", w.mul(w.add(w.mul(lane, kept), ring), recorded), "i64")
    first_beside, done = row["state"] + moving - field.beside, 0
    parts = [(row["state"], n), (first_beside, field.beside), (row["peak"], field.watched)]
    for first, count in parts if field.excursion is None else parts[:1]:

        def record(at: Any, _: Any, first: int = first, done: int = done) -> None:
            behind = at(done)
            at_place = w.add(place, behind if isinstance(behind, Value) else number(behind))
            w.store_if(over, w.get(at(first)), "%strobe", at_place)

        w.over(count, (), record)
        done += count
    if field.excursion is None:
        for k, x in enumerate(watched):
            w.put(row["peak"] + k, w.select(over, x, w.get(row["peak"] + k)))
    place = w.add(w.mul(lane, total), revolution)
    revolution = w.select(over, w.add(revolution, one), revolution)
    w.put(row["revolution"], revolution)
    if field.tangents:
        _orthonormalise(w, field, rows, over, place)
        renew_rates(over)
    finished = w.both(over, w.compare("ge", revolution, total), w.compare("eq", mark, zero))
    w.put(row["mark"], w.select(finished, marked(FINISHED), mark))
    w.line("br label %check")

    w.line("check:")
    leaves = w.both(w.compare("ge", w.get(row["lane"]), zero), w.compare("ne", w.get(row["mark"]), zero))
    w.line(f"br i1 {w.any(leaves)}, label %refill, label %step")
    w.line("return:")
    arguments = (
        "ptr %queue, i64 %lanes, i64 %revolutions, i64 %keep, ptr %settings, ptr %shared, "
        "ptr %loaded, ptr %stored, ptr %strobe, ptr %growth"
    )
    return w.function("march", arguments, linkage="")


def _orthonormalise(w: Code, field: Field, rows: Layout, over: Value, revolution: Value) -> None:
    """Gram-Schmidt orthonormalisation of the tangent vectors where a revolution is over, with two projections to be
    orthogonal to rounding; squared lengths go to `growth`."""
    n, first = field.dimension, rows["state"][0]
    place = w.convert("fptosi", w.mul(revolution, number(float(field.tangents))), "i64")

    def dot(a: int, b: int) -> Value:
        """Scalar product of the vectors that begin at these rows."""
        product = lambda at, sums: [w.add(sums[0], w.mul(w.get(at(a)), w.get(at(b))))]
        return w.over(n, [number(0.0)], product)[0]

    for i in range(field.tangents):
        mine = first + n * (i + 1)
        for earlier in [first + n * (j + 1) for j in range(i)] * 2:
            along = w.select(over, dot(mine, earlier), number(0.0))

            def project(at: Any, _: Any, mine: int = mine, earlier: int = earlier, along: Value = along) -> None:
                w.put(at(mine), w.sub(w.get(at(mine)), w.mul(along, w.get(at(earlier)))))

            w.over(n, (), project)
        length2 = dot(mine, mine)
        w.store_if(over, length2, "%growth", w.add(place, number(i)))
        inverse = w.select(over, w.div(number(1.0), w.call("sqrt", length2)), number(1.0))

        def normalise(at: Any, _: Any, mine: int = mine, inverse: Value = inverse) -> None:
            w.put(at(mine), w.mul(w.get(at(mine)), inverse))

        w.over(n, (), normalise)
