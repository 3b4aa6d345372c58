"""The session of docs/transcript.md: a spindle bearing, by commands alone: `python -m benchmarks.transcript`."""

import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import time


COMMON = {
    "load": '"1.2 kN"',
    "eccentricity": '"G6.3 at 12000 rpm shaft"',
    "bearing.designation": '"NU1014"',
    "lubricant.grade": "32",
    "lubricant.temperature": '"55 degC"',
    "film.land_width": '"2.5 mm"',
}
CAGE = COMMON | {"guidance_gap": '"0.25 mm +- 0.05 mm"'}
BRASS = COMMON | {"guidance_gap": '"0.25 mm"'}
PEEK = {"material": '"PEEK-GF30"'}
INNER = {"guidance": '"inner"\ninner_land_diameter = "83.5 mm"'}
"""Values that are edited in the templates, with their tables; mass and bars of the cage follow from its material."""
RANGE = "--operating '4000-14000 rpm shaft'"


def run(command: str, folder: str) -> None:
    """Run a command of the package and print it with its output."""
    words = [sys.executable, "-m", "jaxcage", *shlex.split(command)[1:]]
    print(f"$ {command}", flush=True)
    subprocess.run(words, cwd=folder, stderr=subprocess.DEVNULL, check=True)
    print(flush=True)


def edit(source: str, path: pathlib.Path, values: dict[str, str]) -> None:
    """Write a file with other values, and print these."""
    print(f"# edited in {path.name}:")
    for name, value in values.items():
        key = name.split(".")[-1]
        source, count = re.subn(rf"^{key} = .*$", f"{key} = {value}", source, count=1, flags=re.M)
        assert count, f"the template has no line that sets {key}"
        print(f"{name} = {value}")
    path.write_text(source, encoding="utf-8")
    print(flush=True)


def main() -> None:
    """Print the session."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        path = lambda name: pathlib.Path(folder, name)
        run("jaxcage init spindle.toml", folder)
        edit(path("spindle.toml").read_text(encoding="utf-8"), path("spindle.toml"), CAGE)
        run("jaxcage statics spindle.toml --speed 12000", folder)
        run(f"jaxcage check spindle.toml {RANGE}", folder)
        run("jaxcage init brass.toml --model bearing", folder)
        template = path("brass.toml").read_text(encoding="utf-8")
        edit(template, path("brass.toml"), BRASS)
        brass = path("brass.toml").read_text(encoding="utf-8")
        run(f"jaxcage check brass.toml {RANGE}", folder)
        for name, values in (("peek", PEEK), ("inner", INNER)):
            print(f"$ cp brass.toml {name}.toml")
            edit(brass, path(f"{name}.toml"), values)
            run(f"jaxcage check {name}.toml {RANGE}", folder)
        run("jaxcage simulate brass.toml --speed 12000 --revolutions 20", folder)
        run(f"jaxcage report spindle.toml --quick {RANGE}", folder)
    print(f"Time in all: {(time.monotonic() - began) / 60:.1f} min")


if __name__ == "__main__":
    main()
