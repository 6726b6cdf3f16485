"""`bunraku up` as users run it: its process, page, API and shutdown."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from tests.time_limit import HANG_TIMEOUT_S

BUNRAKU = Path(sys.executable).parent / "bunraku"


def process_group_members(group: int) -> set[int]:
    """Return the running processes of a process session."""
    found = set()
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == group and fields[0] != "Z":
            found.add(int(status.parent.name))
    return found


@pytest.fixture
def up(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run `bunraku up` with the options of the test; return the process and its address."""
    process = subprocess.Popen(
        [BUNRAKU, "up", *request.param, "--port", "0", "--data", tmp_path / "data"],
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "NO_COLOR": "1", "COLUMNS": "200"},
    )
    assert process.stdout is not None
    try:
        url = None
        for line in process.stdout:
            if found := re.search(r"is at (http://\S+)/", line):
                url = found[1]
                break
        assert url is not None, f"the command ended with {process.wait(HANG_TIMEOUT_S)}"
        yield process, url
    finally:
        if process.poll() is None:
            process.kill()
            process.wait(HANG_TIMEOUT_S)
        process.stdout.close()


@pytest.mark.parametrize("up", [["--demo"]], indirect=True)
def test_demo_plays_and_ctrl_c_ends_every_process(up: tuple[subprocess.Popen[str], str]) -> None:
    process, url = up
    with httpx2.Client(base_url=url) as http:
        assert http.get("/v1/health").json()["status"] == "ok"
        (session,) = http.get("/v1/sessions").json()["items"]
        motion = http.get(f"/v1/motions/{session['motion']}").json()
        assert motion["duration"] >= 20
        assert motion["fit"]["max_mm"] < 1
        page = http.get("/")
        assert page.status_code == 200
        script = re.search(r'src="(/assets/[^"]+\.js)"', page.text)
        assert script is not None
        assert "immutable" in http.get(script[1]).headers["cache-control"]
        assert http.get("/v1/openapi.json").json()["info"]["title"] == "Bunraku"
        assert http.get("/nothing").headers["content-type"].startswith(("application/problem+json", "text/"))
    watched = subprocess.run(
        [BUNRAKU, "watch", session["id"], "--server", url, "--seconds", "1", "--json"],
        capture_output=True,
        text=True,
        check=True,
        timeout=HANG_TIMEOUT_S,
    )
    statistics = json.loads(watched.stdout)
    assert statistics["frames"] > 10
    assert statistics["gaps"] == 0
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(HANG_TIMEOUT_S) == 0
    # the process that forks jobs ends when it detects the end of this one
    deadline = time.monotonic() + HANG_TIMEOUT_S
    while remaining := process_group_members(process.pid):
        assert time.monotonic() < deadline, f"still running: {remaining}"
        time.sleep(0.01)


@pytest.mark.parametrize("up", [[]], indirect=True)
def test_port_in_use_is_reported_without_traceback(up: tuple[subprocess.Popen[str], str]) -> None:
    _, url = up
    second = subprocess.run(
        [BUNRAKU, "up", "--port", url.rpartition(":")[2]],
        capture_output=True,
        text=True,
        timeout=HANG_TIMEOUT_S,
        check=False,
    )
    assert second.returncode == 1
    assert "Cannot listen" in second.stderr
    assert "Traceback" not in second.stderr
