"""Studies: the same bits after kills, from shards and other processes; damage is noticed; lanes are those of sweeps."""

import random
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from scipy import stats

import jaxcage as jc
from jaxcage.files import Range
from jaxcage.lanes import Grid


class Duffing(eqx.Module):
    """x'' + damping x' + x + cubic x^3 = force cos(speed t); with cubic below 0 it runs away."""

    damping: jax.Array
    cubic: jax.Array
    force: jax.Array = eqx.field(default_factory=lambda: jnp.array(0.3))

    def __call__(self, tau, q, v, speed):
        del speed
        (x,), (u,) = q, v
        return (-self.damping * u - x - self.cubic * x**3 + self.force * jnp.cos(tau),)


OSCILLATOR = jc.ForcedOscillator(Duffing(jnp.array(0.1), jnp.array(1.0)), coordinates=1)
SPEEDS, CUBICS = np.linspace(1.1, 1.9, 9), np.array([0.5, 1.0, 1.5, -4.0])
LENGTH: dict[str, Any] = {"discard": 40, "revolutions": 40, "blocks": 4, "method": jc.method("rodas4", steps=32)}
OPTIONS: dict[str, Any] = {**LENGTH, "initial_states": 2, "lanes": 12, "name": "duffing", "version": "1"}
VARY: dict[str, Any] = {"cubic": CUBICS, "speed": SPEEDS, "damping": Range(0.08, 0.12, is_normal=True)}


def duffing_study(store: Path, **more: Any) -> xr.Dataset:
    return jc.study(OSCILLATOR, VARY, store=store, samples=2, seed=3, **(OPTIONS | more))


def contents(store: Path) -> dict[str, bytes]:
    """Every file of a store."""
    return {str(p.relative_to(store)): p.read_bytes() for p in sorted(store.rglob("*")) if p.is_file()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The store of an unbroken run: 2 samples x 4 cubics x 9 speeds x 2 initial states in 16 chunks."""
    jc.keep_compiled_programs(tmp_path_factory.mktemp("programs"))
    store = tmp_path_factory.mktemp("whole") / "study.zarr"
    duffing_study(store)
    return store


@pytest.mark.wide
@pytest.mark.parametrize("places", [((1, 1),), ((0, 0), (0, 2))])
def test_lanes_are_those_of_a_sweep(whole: Path, places: tuple[tuple[int, int], ...]):
    """Labels and exponents of lanes, against sweeps of one system at a time, whose programs hold it as constants."""
    found = jc.open_study(whole)
    assert found["label"].dims == ("sample", "cubic", "speed", "initial_state")
    damping = found["damping"].values
    for i, j in places:
        system = eqx.tree_at(
            lambda s: (s.acceleration.damping, s.acceleration.cubic),
            OSCILLATOR,
            (jnp.array(damping[i]), jnp.array(CUBICS[j])),
        )
        initial_states = [tuple(float(c) for c in start) for start in system.initial_states(1.0)[:2]]
        swept = jc.sweep(system, SPEEDS, initial_states=initial_states, keep=16, confirm=False, horizon=0, **LENGTH)
        mine = found.isel(sample=i, cubic=j)
        assert np.array_equal(mine["label"], swept["label"])
        for name in ("exponents", "standard_error"):
            np.testing.assert_allclose(mine[name], swept[name], rtol=0, atol=1e-9)


def test_neighbours_of_a_lane_do_not_matter(whole: Path, tmp_path: Path):
    """In chunks of another size every lane has the same bits."""
    found, again = jc.open_study(whole), duffing_study(tmp_path / "other.zarr", lanes=7)
    for name in found.data_vars:
        np.testing.assert_array_equal(again[name], found[name])


def test_shards_fill_one_store(whole: Path, tmp_path: Path):
    store = tmp_path / "study.zarr"
    seen: list[tuple[int, int]] = []
    half = duffing_study(store, shard=(2, 2), progress=lambda done, total: seen.append((done, total)))
    assert seen[0] == (0, 64) and seen[-1] == (64, 64)  # chunks of 10 and 8 lanes in turn
    pending = half["outcome"].values == "pending"
    assert np.sum(pending) == 80 and np.all(np.isnan(half["peak"].values[pending]))
    assert np.all(half["label"].values[pending] == "pending")
    duffing_study(store, shard=(1, 2))
    assert contents(store) == contents(whole)


@pytest.mark.wide
def test_killed_at_random_and_resumed(whole: Path, tmp_path: Path):
    """SIGKILL at random moments, four times; whoever starts again ends with the very files of an unbroken run."""
    store, dice = tmp_path / "study.zarr", random.Random(1)
    programs = jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]
    code = (
        "import sys, pathlib, jaxcage as jc, jax; jax.config.update('jax_enable_x64', True); "
        f"sys.path.insert(0, {str(Path(__file__).parent)!r}); "
        f"jax.config.update('jax_compilation_cache_dir', {programs!r}); "
        "import test_studies as t; t.duffing_study(pathlib.Path(sys.argv[1]), "
        "progress=lambda done, total: print(done, flush=True))"
    )
    stored = [0]
    for _ in range(4):
        with subprocess.Popen([sys.executable, "-c", code, str(store)], stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            seen: set[int] = set()  # a slow machine repeats a number within a chunk
            chunks = dice.randint(1, 4)
            while len(seen) < chunks:
                seen.add(int(process.stdout.readline()))
            try:
                process.wait(dice.uniform(0.0, 0.05))
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
        assert process.returncode == -signal.SIGKILL
        stored.append(max(seen))
    assert stored == sorted(stored) and 0 < stored[-1] < 144
    duffing_study(store)
    assert contents(store) == contents(whole)


@pytest.mark.parametrize(
    "change, words",
    [
        ({"vary": {"cubic": CUBICS}}, "must hold the speed"),
        ({"vary": {"speed": SPEEDS, "cubik": CUBICS}}, "must be one of speed, .*cubic, force, but 'cubik'"),
        ({"vary": {"speed": np.array([1.0, 1.0])}}, "distinct numbers for speed"),
        ({"vary": VARY, "samples": 0}, "samples` must say how many"),
        ({"vary": {"speed": SPEEDS}, "samples": 8}, "samples` needs an interval or a tolerance"),
        ({"blocks": 7}, "blocks` must divide"),
        ({"shard": (0, 2)}, "shard` must be"),
    ],
)
def test_what_makes_no_sense_is_refused(tmp_path: Path, change: dict, words: str):
    options: dict = {"vary": {"speed": SPEEDS}, "store": tmp_path / "study.zarr", **OPTIONS} | change
    with pytest.raises(ValueError, match=words):
        jc.study(OSCILLATOR, options.pop("vary"), **options)
    assert list(tmp_path.iterdir()) == []


def test_samples_fill_their_distributions():
    """A Sobol sequence has one point in each of n equal parts, of every parameter; a tolerance is a normal distribution
    cut off at three standard deviations."""
    speed = {"speed": np.ones(1)}
    sampled = {"a": Range(2.0, 6.0), "b": Range(9.7, 10.3, is_normal=True)}
    first, again, other = (Grid(speed, sampled, 256, seed, 1).cloud for seed in (0, 0, 1))
    assert all(np.array_equal(first[name], again[name]) for name in sampled)
    assert not np.array_equal(first["a"], other["a"])
    assert np.array_equal(np.sort(np.floor((first["a"] - 2.0) / 4.0 * 256)), np.arange(256))
    normal = stats.norm(10.0, 0.1)
    inside = (normal.cdf(first["b"]) - normal.cdf(9.7)) / (normal.cdf(10.3) - normal.cdf(9.7))
    assert np.array_equal(np.sort(np.floor(inside * 256)), np.arange(256))
    assert np.array_equal(Grid(speed, sampled, 100, 0, 1).cloud["b"], first["b"][:100])


@pytest.fixture
def store(whole: Path, tmp_path: Path) -> Path:
    """A copy of a finished store."""
    return Path(shutil.copytree(whole, tmp_path / "study.zarr"))


def deleted(path: Path) -> None:
    path.unlink()


def flipped(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1] + bytes([path.read_bytes()[-1] ^ 1]))


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


@pytest.mark.parametrize("name", ["label", "outcome"])
@pytest.mark.parametrize("spoil", [deleted, flipped, cut])
def test_a_damaged_chunk_is_noticed_and_computed_again(
    whole: Path, store: Path, name: str, spoil: Callable[[Path], None]
):
    chunk = sorted(p for p in (store / name / "c").rglob("*") if p.is_file())[2]
    spoil(chunk)
    if spoil is not deleted:
        with pytest.raises(ValueError, match="checksum"):
            jc.open_study(store).load()
    duffing_study(store)
    assert contents(store) == contents(whole)


@pytest.mark.parametrize("name", ["zarr.json", "label/zarr.json"])
def test_what_cannot_be_opened_is_refused_in_one_sentence(store: Path, name: str):
    cut(store / name)
    for use in (jc.open_study, duffing_study):
        with pytest.raises(ValueError, match=r"^The store '.*' is damaged .*: choose another folder") as said:
            use(store)
        assert "\n" not in str(said.value)


@pytest.mark.parametrize(
    "change, words",
    [
        ({"revolutions": 20}, "differs in revolutions: choose another folder"),
        ({"version": "2"}, "differs in version: choose another folder"),
        ({"method": jc.method("rodas4", steps=48)}, "differs in method, method_numbers.steps: choose"),
    ],
)
def test_another_study_is_refused_by_what_differs(whole: Path, change: dict[str, Any], words: str):
    before = contents(whole)
    with pytest.raises(ValueError, match=words):
        duffing_study(whole, **change)
    assert contents(whole) == before


def law(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
    return (-q[0],)


@pytest.mark.parametrize("given", [{"name": ""}, {"version": ""}])
@pytest.mark.parametrize(
    "system, own", [(OSCILLATOR, "Duffing"), (jc.ForcedOscillator(jax.jit(law), coordinates=1), "law")]
)
def test_code_of_ones_own_needs_a_name_and_a_version(tmp_path: Path, system: Any, own: str, given: dict[str, str]):
    said = f"`name` and `version` must be given, since a store cannot tell .* own {own} "
    with pytest.raises(ValueError, match=said):
        jc.study(system, {"speed": SPEEDS}, store=tmp_path / "study.zarr", **OPTIONS | given)
    with pytest.raises(ValueError, match=f"`store` must be left out, since .* own {own} .*`study` takes a name"):
        jc.sweep(system, SPEEDS, store=tmp_path / "sweep.zarr", confirm=False, horizon=0)
    assert list(tmp_path.iterdir()) == []
