"""LLVM IR of a traced scalar function, for vectors of lanes.

A number common to all lanes remains a scalar; every other one is a vector with an element per lane. Operations that are
needed on only one side of a `select` are skipped if no lane of the vector takes that side (`branches`): for instance
the contact force, while no cage of the vector touches its land.
"""

import functools
import graphlib
import heapq
import struct
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax.extend as jex
import numpy as np


FLAGS = "nsz arcp contract"
"""Flags that let LLVM fuse multiplications and additions, divide by multiplying, and ignore the sign of zero; NaN and
infinity keep their meaning."""
WORTH_A_BRANCH = 12
"""Smallest cost of the operations under a branch that is worth it."""
COST = {"div": 6, "sqrt": 6, "rsqrt": 6, "exp": 20, "log": 20, "sin": 20, "cos": 20, "tan": 20, "pow": 40, "atan2": 40}
"""Cost of expensive operations; others cost 1."""
ARITHMETIC = {"add": "add", "add_any": "add", "sub": "sub", "mul": "mul", "div": "div", "rem": "rem"}
COMPARISONS = {"lt": "lt", "le": "le", "gt": "gt", "ge": "ge", "eq": "eq", "ne": "ne"}
SHIFTS = {"shift_left": "shl", "shift_right_logical": "lshr", "shift_right_arithmetic": "ashr"}
BITWISE = {"and": "and", "or": "or", "xor": "xor", **SHIFTS}
SAME_NAME = "sqrt floor ceil exp exp2 log log2 sin cos tan asin acos atan atan2 sinh cosh tanh pow copysign".split()
INTRINSICS = {**dict(zip(SAME_NAME, SAME_NAME)), "abs": "fabs"}
CASTS = {("double", "i64"): "fptosi", ("i64", "double"): "sitofp", ("i1", "double"): "uitofp", ("i1", "i64"): "zext"}

WRITTEN_OUT = 48
"""Largest number of rows for which a loop over them is unrolled."""

Path = tuple[tuple[Any, int], ...]
"""Masks, and the value of each, under which a variable is needed."""


class UnknownOperation(Exception):
    """Error for an operation without a translation, with its name as argument."""


@functools.cache
def say_once(operation: str) -> None:
    """Warn once of an operation that has no translation."""
    warnings.warn(
        f"The law uses the operation `{operation}`, which has no machine code here: JAX's own loop is taken instead, "
        "which is slower.",
        stacklevel=3,
    )


def is_variable(atom: Any) -> bool:
    """True for a variable of a jaxpr, False for a literal."""
    return not isinstance(atom, jex.core.Literal)


def branches(equations: Sequence[Any], results: Sequence[Any]) -> dict[Any, Path]:
    """Masks under which each variable is needed; () for a variable that is always needed."""
    path: dict[Any, Path] = {v: () for v in results if is_variable(v)}
    for e in reversed(equations):
        own = path[e.outvars[0]]
        for k, v in enumerate(e.invars):
            if is_variable(v):
                always = e.primitive.name != "select_n" or k == 0 or any(m is e.invars[0] for m, _ in own)
                needed = own if always else (*own, (e.invars[0], k - 1))
                path[v] = _common(path[v], needed) if v in path else needed
    kinds = dict.fromkeys(path[e.outvars[0]] for e in equations)  # ordered, so that the code is reproducible
    for p in sorted(dict.fromkeys(p[:n] for p in kinds for n in range(1, len(p) + 1)), key=len, reverse=True):
        inside = [e for e in equations if path[e.outvars[0]][: len(p)] == p]
        if sum(COST.get(e.primitive.name, 1) for e in inside) < WORTH_A_BRANCH:
            path.update({e.outvars[0]: p[:-1] for e in inside})
    return path


def _common(a: Path, b: Path) -> Path:
    """Common beginning of two paths."""
    n = next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    return a[:n]


def in_groups(equations: Sequence[Any], path: dict[Any, Path]) -> list[tuple[Path, list[Any]]]:
    """Equations in as few groups of one path each as possible; those that are always needed come first."""
    made = {v: i for i, e in enumerate(equations) for v in e.outvars}
    paths = [path[e.outvars[0]] for e in equations]
    reads = [(*e.invars, *(m for m, _ in p)) for e, p in zip(equations, paths, strict=True)]
    before = ({made[v] for v in row if is_variable(v) and v in made} for row in reads)
    order = graphlib.TopologicalSorter(dict(enumerate(before)))
    order.prepare()
    ready: dict[Path, list[int]] = {p: [] for p in sorted(dict.fromkeys(paths), key=len)}

    def collect() -> None:
        for i in order.get_ready():
            heapq.heappush(ready[paths[i]], i)

    collect()
    groups: list[tuple[Path, list[Any]]] = []
    while any(ready.values()):
        p = next(p for p, rows in ready.items() if rows)
        groups.append((p, []))
        while ready[p]:
            i = heapq.heappop(ready[p])
            groups[-1][1].append(equations[i])
            order.done(i)
            collect()
    return groups


class Value(NamedTuple):
    """An operand: its text, its scalar type, and `wide`, True for a vector of lanes."""

    text: str
    kind: str
    wide: bool = False

    @property
    def known(self) -> bool:
        """True for a literal."""
        return not self.text.startswith("%")

    def __str__(self) -> str:
        return self.text


def number(x: Any) -> Value:
    x = np.asarray(x)
    if x.dtype == bool:
        return Value("true" if x else "false", "i1")
    if x.dtype.kind in "iu":
        return Value(str(int(x)), "i64")
    return Value(f"0x{struct.unpack('<Q', struct.pack('<d', float(x)))[0]:016X}", "double")


Function = tuple[str, set[str]]
"""Code of a function, and the declarations that it needs."""


def module(*functions: Function) -> str:
    """Code of a module of functions."""
    declarations = sorted(set().union(*(declared for _, declared in functions)))
    return "\n".join([*(text for text, _ in functions), *declarations, '!0 = !{!"branch_weights", i32 1, i32 30}', ""])


class Code:
    """Lines of a function's body; an operation is on vectors if any of its operands is a vector. Vectors are stored in
    rows of memory; a row is a number, or a value within a loop over rows."""

    block = "entry"
    """Name of the current block."""

    def __init__(self, width: int):
        self.width, self.lines, self.names, self.declarations = width, [], 0, set[str]()

    def type(self, kind: str, wide: bool) -> str:
        return f"<{self.width} x {kind}>" if wide else kind

    def typed(self, v: Value) -> str:
        return f"{self.type(v.kind, v.wide)} {v}"

    def line(self, text: str) -> None:
        self.lines.append(text if text.endswith(":") else f"  {text}")
        if text.endswith(":"):
            self.block = text[:-1]

    def let(self, text: str, kind: str, wide: bool = False) -> Value:
        self.names += 1
        self.line(f"%v{self.names} = {text}")
        return Value(f"%v{self.names}", kind, wide)

    def widened(self, v: Value) -> Value:
        """Broadcast a scalar to a vector."""
        if v.wide:
            return v
        if v.known:
            return Value(f"splat ({v.kind} {v})", v.kind, True)
        one = self.let(f"insertelement {self.type(v.kind, True)} poison, {v.kind} {v}, i64 0", v.kind, True)
        zeros = f"<{self.width} x i32> zeroinitializer"
        return self.let(f"shufflevector {self.typed(one)}, {self.typed(one)}, {zeros}", v.kind, True)

    def alike(self, x: Sequence[Value]) -> list[Value]:
        """Broadcast operands to one shape."""
        return [self.widened(v) for v in x] if any(v.wide for v in x) else list(x)

    def simple(self, op: str, *operands: Value, kind: str | None = None) -> Value:
        """Write an instruction whose operands are all of one type."""
        x = self.alike(operands)
        rest = "".join(f", {v}" for v in x[1:])
        return self.let(f"{op} {self.typed(x[0])}{rest}", kind or x[0].kind, x[0].wide)

    def call(self, name: str, *operands: Value) -> Value:
        """Write a call of one of LLVM's intrinsic functions."""
        x = self.alike(operands)
        t = self.type(x[0].kind, x[0].wide)
        full = f"llvm.{name}.{f'v{self.width}' if x[0].wide else ''}{'f64' if x[0].kind == 'double' else x[0].kind}"
        flags = f"{FLAGS} " if x[0].kind == "double" else ""
        self.declarations.add(f"declare {t} @{full}({', '.join([t] * len(x))})")
        return self.let(f"call {flags}{t} @{full}({', '.join(map(self.typed, x))})", x[0].kind, x[0].wide)

    def arithmetic(self, op: str, *x: Value) -> Value:
        if x[0].kind == "double":
            return self.simple(f"f{op} {FLAGS}", *x)
        return self.simple({"div": "sdiv", "rem": "srem"}.get(op, op), *x)

    def add(self, *x: Value) -> Value:
        return functools.reduce(lambda a, b: self.arithmetic("add", a, b), x)

    def sub(self, a: Value, b: Value) -> Value:
        return self.arithmetic("sub", a, b)

    def mul(self, *x: Value) -> Value:
        return functools.reduce(lambda a, b: self.arithmetic("mul", a, b), x)

    def div(self, a: Value, b: Value) -> Value:
        return self.arithmetic("div", a, b)

    def compare(self, op: str, a: Value, b: Value) -> Value:
        """Write a comparison; with NaN all but `ne` are false."""
        if a.kind == "double":
            return self.simple(f"fcmp {'une' if op == 'ne' else 'o' + op}", a, b, kind="i1")
        if a.kind == "i1":
            return self.simple(f"icmp {op}", a, b, kind="i1")
        return self.simple(f"icmp {op if op in ('eq', 'ne') else 's' + op}", a, b, kind="i1")

    def both(self, *masks: Value) -> Value:
        return functools.reduce(lambda a, b: self.simple("and", a, b), masks)

    def negated(self, mask: Value) -> Value:
        return self.simple("xor", mask, number(True))

    def select(self, mask: Value, yes: Value, no: Value) -> Value:
        yes, no = (self.widened(yes), self.widened(no)) if mask.wide else self.alike((yes, no))
        flags = f"{FLAGS} " if yes.kind == "double" else ""
        return self.let(f"select {flags}{self.typed(mask)}, {self.typed(yes)}, {self.typed(no)}", yes.kind, yes.wide)

    def larger(self, a: Value, b: Value) -> Value:
        """Larger of two numbers; b where a is NaN."""
        return self.select(self.compare("gt", a, b), a, b)

    def smaller(self, a: Value, b: Value) -> Value:
        """Smaller of two numbers; b where a is NaN."""
        return self.select(self.compare("lt", a, b), a, b)

    def extreme(self, op: str, a: Value, b: Value) -> Value:
        """Larger (`gt`) or smaller (`lt`) of two numbers, NaN if either is."""
        if a.known or b.known:
            known, other = (a, b) if a.known else (b, a)
            return self.select(self.compare(op, known, other), known, other)
        return self.call("maximum" if op == "gt" else "minimum", a, b)

    def power(self, x: Value, n: int) -> Value:
        if n < 0:
            return self.div(number(1.0), self.power(x, -n))
        if n == 0:
            return number(1.0)
        half = x if n < 2 else self.power(self.mul(x, x), n // 2)
        return half if n == 1 or n % 2 == 0 else self.mul(half, x)

    def any(self, mask: Value) -> Value:
        """True if a mask holds for any lane."""
        if not mask.wide:
            return mask
        return self.compare("ne", self.bits(mask), number(0))

    def bits(self, mask: Value) -> Value:
        """The bits of a mask as one integer."""
        return self.let(f"bitcast {self.typed(mask)} to i{self.width}", f"i{self.width}")

    def largest(self, v: Value) -> Value:
        """Largest number of a vector."""
        name = f"@llvm.vector.reduce.fmax.v{self.width}f64"
        self.declarations.add(f"declare double {name}({self.type('double', True)})")
        return self.let(f"call double {name}({self.typed(v)})", "double")

    def convert(self, op: str, x: Value, kind: str) -> Value:
        return self.let(f"{op} {self.typed(x)} to {self.type(kind, x.wide)}", kind, x.wide)

    def equation(self, e: Any, x: list[Value]) -> Value:
        """Result of one operation of a jaxpr. **Raises:** `UnknownOperation`."""
        name = e.primitive.name
        if name in ARITHMETIC:
            return self.arithmetic(ARITHMETIC[name], *x)
        if name in COMPARISONS:
            return self.compare(COMPARISONS[name], *x)
        if name in BITWISE:
            return self.simple(BITWISE[name], *x)
        if name in INTRINSICS and x[0].kind == "double":
            return self.call(INTRINSICS[name], *x)
        if name in ("max", "min") and x[0].kind == "double":
            return self.extreme("gt" if name == "max" else "lt", *x)
        if name == "select_n" and len(x) == 3 and x[0].kind == "i1":
            return self.select(x[0], x[2], x[1])
        if name == "clamp":
            return self.extreme("lt", self.extreme("gt", x[1], x[0]), x[2])
        if name == "neg" and x[0].kind == "double":
            return self.simple(f"fneg {FLAGS}", *x)
        if name == "sign" and x[0].kind == "double":
            one = self.call("copysign", number(1.0), x[0])
            return self.select(self.compare("ne", x[0], number(0.0)), self.add(one, self.mul(x[0], number(0.0))), x[0])
        if name == "not" and x[0].kind == "i1":
            return self.negated(x[0])
        if name == "integer_pow":
            return self.power(x[0], e.params["y"])
        if name == "square":
            return self.mul(x[0], x[0])
        if name == "one_minus_square":
            return self.mul(self.add(number(1.0), x[0]), self.sub(number(1.0), x[0]))
        if name == "cbrt":
            root = self.call("pow", self.call("fabs", *x), number(1 / 3))
            return self.call("copysign", root, x[0])
        if name == "rsqrt":
            return self.div(number(1.0), self.call("sqrt", *x))
        if name == "log1p":  # W. Kahan's form, accurate although 1 + x is rounded
            u = self.add(x[0], number(1.0))
            quotient = self.div(self.mul(x[0], self.call("log", u)), self.sub(u, number(1.0)))
            return self.select(self.compare("eq", u, number(1.0)), x[0], quotient)
        if name == "expm1":
            u = self.call("exp", x[0])
            less = self.sub(u, number(1.0))
            quotient = self.div(self.mul(less, x[0]), self.call("log", u))
            plain = self.simple("or", self.compare("gt", u, number(1e12)), self.compare("lt", u, number(1e-17)))
            return self.select(self.compare("eq", u, number(1.0)), x[0], self.select(plain, less, quotient))
        if name == "logistic":
            return self.div(number(1.0), self.add(number(1.0), self.call("exp", self.simple(f"fneg {FLAGS}", *x))))
        if name == "round":
            return self.call("roundeven" if int(e.params["rounding_method"]) else "round", x[0])
        if name == "is_finite":
            return self.compare("lt", self.call("fabs", *x), number(np.inf))
        if name in ("stop_gradient", "copy"):
            return x[0]
        if name in ("bitcast_convert_type", "convert_element_type"):
            kind = {"f": "double", "i": "i64", "u": "i64", "b": "i1"}[np.dtype(e.params["new_dtype"]).kind]
            if kind == x[0].kind:
                return x[0]
            cast = "bitcast" if name[0] == "b" else CASTS.get((x[0].kind, kind))
            if cast:
                return self.convert(cast, x[0], kind)
        raise UnknownOperation(name)

    def program(self, program: Any, arguments: Sequence[Value]) -> list[Value]:
        """Write a traced function; return its results."""
        jaxpr = program.jaxpr
        known: dict[Any, Value] = dict(zip(jaxpr.invars, arguments, strict=True))
        known |= {v: number(c) for v, c in zip(jaxpr.constvars, program.consts, strict=True)}
        read = lambda atom: known[atom] if is_variable(atom) else number(atom.val)
        for path, equations in in_groups(jaxpr.eqns, branches(jaxpr.eqns, jaxpr.outvars)):

            def write(equations: Sequence[Any] = equations) -> list[Value]:
                for e in equations:
                    known[e.outvars[0]] = self.equation(e, [read(v) for v in e.invars])
                return [known[e.outvars[0]] for e in equations]

            if not path:
                write()
                continue
            some = self.any(self.both(*(known[m] if side else self.negated(known[m]) for m, side in path)))
            known.update(zip((e.outvars[0] for e in equations), self.when(some, write, "!prof !0"), strict=True))
        return [read(v) for v in jaxpr.outvars]

    def when(self, some: Value, body: Callable[[], Any], *about: str, otherwise: Any = None) -> list[Value]:
        """Write `body()`, which runs if `some` is true; return its results, or those of `otherwise` (by default
        undefined). The branch may have data `about` it."""
        self.names += 1
        before, block, after = self.block, f"some{self.names}", f"after{self.names}"
        self.line(", ".join([f"br i1 {some}, label %{block}, label %{after}", *about]))
        self.line(f"{block}:")
        results = body() or ()
        block = self.block
        self.line(f"br label %{after}")
        self.line(f"{after}:")
        others = otherwise or [Value("poison", v.kind) for v in results]
        merged = lambda v, other: f"phi {self.type(v.kind, v.wide)} [ {v}, %{block} ], [ {other}, %{before} ]"
        return [self.let(merged(v, other), v.kind, v.wide) for v, other in zip(results, others, strict=True)]

    def loop(
        self, end: Value, begin: Sequence[Value], body: Callable[[Value, list[Value]], Any], step: int = 1
    ) -> list[Value]:
        """Apply `body(number, values)` to `begin` and then to its results, for numbers from 0 to `end`, which is
        positive, by `step`."""
        self.names += 1
        name, before, head, after = f"%n{self.names}", self.block, f"loop{self.names}", f"done{self.names}"
        values = [v._replace(text=f"{name}_{k}") for k, v in enumerate(begin)]
        outer, self.lines, self.block = self.lines, [], head
        new: list[Value] = list(body(Value(name, "i64"), values) or ())
        latch, lines, self.lines = self.block, self.lines, outer
        self.line(f"br label %{head}")
        self.line(f"{head}:")
        self.line(f"{name} = phi i64 [ 0, %{before} ], [ {name}_next, %{latch} ]")
        for v, first, later in zip(values, begin, new, strict=True):
            self.line(f"{v} = phi {self.type(v.kind, v.wide)} [ {first}, %{before} ], [ {later}, %{latch} ]")
        self.lines += lines
        self.line(f"{name}_next = add i64 {name}, {step}")
        self.line(f"{name}_more = icmp slt i64 {name}_next, {end}")
        self.line(f"br i1 {name}_more, label %{head}, label %{after}")
        self.line(f"{after}:")
        return new

    def function(self, name: str, arguments: str, result: Value | None = None, linkage: str = "internal ") -> Function:
        """The lines written as a function, and its declarations."""
        kind, value = (result.kind, f" {result}") if result else ("void", "")
        lines = "\n".join(self.lines)
        text = f"define {linkage}{kind} @{name}({arguments}) noinline {{\nentry:\n{lines}\n  ret {kind}{value}\n}}\n"
        return text, self.declarations

    def element(self, base: str | Value, index: int | Value, kind: str = "double") -> Value:
        """Address of an element of an array of scalars."""
        return self.let(f"getelementptr {kind}, ptr {base}, i64 {index}", "ptr")

    def load(self, address: Value, kind: str = "double", wide: bool = False, how: str = "") -> Value:
        """Load what is at an address; `how` is the alignment of a vector if it is not that of its type."""
        return self.let(f"load {self.type(kind, wide)}, ptr {address}{how}", kind, wide)

    def store(self, v: Value, address: Value, how: str = "") -> None:
        self.line(f"store {self.typed(v)}, ptr {address}{how}")

    def load_atomically(self, address: Value) -> Value:
        """Load an integer that threads share."""
        return self.let(f"load atomic volatile i64, ptr {address} monotonic, align 8", "i64")

    def add_atomically(self, address: Value, x: Value) -> Value:
        """Add to an integer that threads share; return what it was."""
        return self.let(f"atomicrmw add ptr {address}, {self.typed(x)} monotonic", x.kind)

    def at(self, row: int | Value, base: str = "%memory") -> Value:
        size = self.width * 8
        return self.element(base, self.mul(row, number(size)) if isinstance(row, Value) else row * size, "i8")

    def get(self, row: int | Value, wide: bool = True, base: str = "%memory") -> Value:
        return self.load(self.at(row, base), wide=wide)

    def put(self, row: int | Value, v: Value, wide: bool = True, base: str = "%memory") -> None:
        self.store(self.widened(v) if wide else v, self.at(row, base))

    def all(self, rows: Sequence[int]) -> list[Value]:
        return [self.get(r) for r in rows]

    def over(
        self,
        count: int,
        begin: Sequence[Value],
        body: Callable[[Callable[[int], int | Value], list[Value]], Any],
        written_out: int = WRITTEN_OUT,
    ) -> list[Value]:
        """Apply `body(row, values)` to `begin` and then to its results, for `count` rows, unrolled if they are few;
        `row(k)` is the k-th row plus the number of the present pass."""
        values = [self.widened(v) for v in begin]
        if count > written_out:
            row = lambda place: lambda k: self.add(place, number(k)) if k else place
            return self.loop(number(count), values, lambda place, values: body(row(place), values))
        for q in range(count):
            values = body(lambda k, q=q: k + q, values) or []
        return values

    def log2(self, x: Value) -> Value:
        """Binary logarithm of a positive number, within 0.09."""
        bits = self.convert("bitcast", self.convert("fptrunc", x, "float"), "i32")
        return self.sub(self.mul(self.convert("sitofp", bits, "double"), number(2.0**-23)), number(127.0))

    def exp2(self, x: Value) -> Value:
        """Two to the power of x, within 6 %; the inverse of `log2`."""
        bits = self.convert("fptosi", self.mul(self.add(x, number(127.0)), number(2.0**23)), "i32")
        return self.convert("fpext", self.convert("bitcast", bits, "float"), "double")

    def store_if(self, mask: Value, x: Value, base: str, index: Value) -> None:
        """Store x at base[index] in the lanes where the mask holds."""
        at = self.let(f"getelementptr double, ptr {base}, {self.typed(index)}", "ptr", True)
        v, m = self.type("double", True), self.type("i1", True)
        name = f"@llvm.masked.scatter.v{self.width}f64.v{self.width}p0"
        self.declarations.add(f"declare void {name}({v}, <{self.width} x ptr>, {m})")
        self.line(f"call void {name}({self.typed(self.widened(x))}, {self.typed(at)}, {self.typed(mask)})")
