"""Being told to end: a sentence, an exit status, and nothing half done; a second signal does not wait."""

import signal
import subprocess
import sys

import pytest


CODE = """
import sys, time
from jaxcage.cli import _console
from jaxcage.cli._main import main
import jaxcage.cli._main as m
def carry_out(options):
    try:
        if sys.argv[1] == "computing":
            with _console.progress("x", advice="what is stored stays"):
                print("ready", flush=True)
                time.sleep(60)
        print("ready", flush=True)
        time.sleep(60)
    finally:
        if sys.argv[1] == "tidying for long":
            print("tidying", flush=True)
            time.sleep(60)
m._carry_out = carry_out
m._parse = lambda arguments: 1
sys.exit(main())
"""


def start(where: str) -> subprocess.Popen[str]:
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, "-c", CODE, where], text=True, stdout=pipe, stderr=pipe)


@pytest.mark.parametrize("where, said", [("computing", "what is stored stays"), ("writing", "files of earlier runs")])
def test_told_to_end_it_says_so_and_ends(where: str, said: str):
    with start(where) as process:
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=20)
    assert process.returncode == 143 and err.startswith(f"Interrupted: {said}") and err.count("\n") == 1


@pytest.mark.parametrize("second", [signal.SIGINT, signal.SIGTERM])
def test_a_second_signal_ends_at_once(second: signal.Signals):
    with start("tidying for long") as process:
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGTERM)
        assert process.stdout.readline() == "tidying\n"
        process.send_signal(second)
        process.communicate(timeout=20)
    assert process.returncode == -second
