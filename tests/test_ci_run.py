"""The script of CI, `.ci/run`, with programs in place of make and pytest that fail as a case says."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY

PYTHON_FAILED = "FAILED tests/a/test_one.py::test_of_{} - AssertionError: slow\n"
PYTHON_TARGET = "make: *** [Makefile:80: test-python] Error 1\nmake: Target 'test' not remade because of errors.\n"
WEB_FAILED = "\nfailed:\n  tests/browser/strings.test.ts > a test {}: expected true\n\n"
PROGRAMS = (
    *("caddy", "chromium", "firefox-esr", "nats-server", "pulseaudio", "prometheus"),
    *("strace", "WebKitWebDriver", "Xvfb", "initdb", "ip"),
)
WEB_TARGET = "make: *** [Makefile:94: test-web] Error 1\n"


def run_ci(folder: Path, output: str, *, fails_again: bool = False) -> subprocess.CompletedProcess[str]:
    """Run a copy of the script. `make test` prints `output` and fails if it names an error."""
    (folder / ".ci").mkdir()
    shutil.copy(REPOSITORY / ".ci" / "run", folder / ".ci" / "run")
    (folder / "output").write_text(output)
    status = int(fails_again)
    make = f"""case "$*" in
      *FILES=*) echo "again: $*"; exit {status};;
      *) cat output; ! grep -q Error output;;
    esac"""
    write_program(folder / "programs" / "make", make)
    write_program(folder / ".venv" / "bin" / "pytest", f'echo "again: pytest $*"; exit {status}')
    # so that nothing is installed
    for name in PROGRAMS:
        write_program(folder / "programs" / name, "exit 1")
    path = os.pathsep.join([str(folder / "programs"), os.environ["PATH"]])
    return subprocess.run([folder / ".ci" / "run"], env={**os.environ, "PATH": path}, capture_output=True, text=True)


def write_program(path: Path, script: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/usr/bin/env bash\n{script}\n")
    path.chmod(0o755)


def test_success_runs_nothing_again(tmp_path: Path) -> None:
    run = run_ci(tmp_path, "6225 passed\n")
    assert run.returncode == 0
    assert "again" not in run.stdout


@pytest.mark.parametrize(
    ("output", "again"),
    [
        (PYTHON_FAILED.format(1) + PYTHON_TARGET, "again: pytest --last-failed"),
        (WEB_FAILED.format(1) + WEB_TARGET, "FILES=tests/browser/strings.test.ts"),
        (WEB_FAILED.format(1) + WEB_TARGET + PYTHON_FAILED.format(1) + PYTHON_TARGET, "FILES="),
    ],
)
def test_few_failed_tests_run_again_and_are_named(tmp_path: Path, output: str, again: str) -> None:
    run = run_ci(tmp_path, output)
    assert run.returncode == 0, run.stdout
    assert again in run.stdout
    named = run.stdout.partition("flaky, to be mended:")[2]
    assert all(line in named for line in output.splitlines() if line.startswith(("FAILED", "  ")))


@pytest.mark.parametrize("output", [PYTHON_FAILED.format(1) + PYTHON_TARGET, WEB_FAILED.format(1) + WEB_TARGET])
def test_test_that_fails_again_fails_ci(tmp_path: Path, output: str) -> None:
    run = run_ci(tmp_path, output, fails_again=True)
    assert run.returncode != 0
    assert "again: " in run.stdout
    assert "flaky" not in run.stdout


@pytest.mark.parametrize(
    "output",
    [
        "".join(PYTHON_FAILED.format(number) for number in range(4)) + PYTHON_TARGET,
        "make: *** [Makefile:71: lint] Error 1\n",
        PYTHON_FAILED.format(1) + PYTHON_TARGET + "make: *** [Makefile:71: lint] Error 1\n",
        # the checks before the tests, a run without a result, an error that belongs to no test
        WEB_TARGET,
        PYTHON_TARGET,
        PYTHON_FAILED.format(1) + PYTHON_TARGET + WEB_TARGET,
        "\nfailed:\n  outside of a test: Unhandled rejection\n\n" + WEB_TARGET,
    ],
)
def test_other_failures_fail_ci_at_once(tmp_path: Path, output: str) -> None:
    run = run_ci(tmp_path, output)
    assert run.returncode != 0
    assert "again" not in run.stdout
