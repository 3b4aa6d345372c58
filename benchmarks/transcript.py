"""The session of docs/transcript.md: a bearing of one's own, by commands alone: `python -m benchmarks.transcript`."""

import pathlib
import re
import shlex
import subprocess
import sys
import tempfile


FILE = "my_bearing.toml"
VALUES = {
    "guidance_gap": "0.6 mm",
    "eccentricity": "30 um",
    "cage_mass": "0.40 kg",
    "bore": "60 mm",
    "outside_diameter": "130 mm",
    "width": "46 mm",
    "roller_diameter": "19 mm",
    "roller_length": "31 mm",
    "rib_diameter": "109 mm",
    "inner_raceway_diameter": "77 mm",
    "pocket_clearance": "0.7 mm",
    "temperature": "60 degC",
}
"""What is edited in the template."""
SHOWN = "^(guidance|ecc|cage_mass|bore|outside|width|roller_|rib|inner|pocket|temp)"


def show(command: str, folder: str) -> None:
    """Run a command of the package and print it with what it says."""
    words = [sys.executable, "-m", "jaxcage", *shlex.split(command)[1:]]
    print(f"$ {command}", flush=True)
    subprocess.run(words, cwd=folder, stderr=subprocess.STDOUT, check=True)
    print(flush=True)


def main() -> None:
    """Print the session."""
    with tempfile.TemporaryDirectory() as folder:
        show(f"jaxcage init {FILE} --full", folder)
        path = pathlib.Path(folder, FILE)
        text = path.read_text(encoding="utf-8")
        for name, value in VALUES.items():
            text, count = re.subn(rf"^{name} = .*$", f'{name} = "{value}"', text, count=1, flags=re.M)
            assert count, f"the template has no line that sets {name}"
        path.write_text(text, encoding="utf-8")
        print(f'$ grep -E "{SHOWN}" {FILE}  # after editing')
        print("\n".join(x for x in text.splitlines() if re.match(SHOWN, x)), end="\n\n", flush=True)
        for words in ("statics F", "sweep F --draws 0", "design F --steps 8"):
            show(f"jaxcage {words.replace('F', FILE)}", folder)
        show(f"jaxcage report {FILE} --quick --operating '5000-8000 rpm'", folder)


if __name__ == "__main__":
    main()
