"""The wheel of `make package`, installed into an empty environment: services, page and command work from it alone."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from tests.time_limit import HANG_TIMEOUT_S

pytestmark = pytest.mark.timeout(900)

ROOT = Path(__file__).resolve().parents[2]
UV = shutil.which("uv") or ROOT / ".tools" / "bin" / "uv"


def run(*command: object, **options: object) -> str:
    result = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, check=False, timeout=600, **options
    )  # type: ignore[call-overload]
    assert result.returncode == 0, result.stdout + result.stderr
    return str(result.stdout)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of commands of an environment that contains the wheel, its locked dependencies and nothing else."""
    folder = tmp_path_factory.mktemp("package")
    run(UV, "build", "--quiet", "--wheel", "--out-dir", folder, ROOT)
    (wheel,) = folder.glob("*.whl")
    run(UV, "venv", "--quiet", "--python", sys.executable, folder / "env")
    python = folder / "env" / "bin" / "python"
    run(UV, "pip", "install", "--quiet", "--python", python, "--require-hashes", "-r", ROOT / "requirements.lock")
    run(UV, "pip", "install", "--quiet", "--python", python, "--no-deps", wheel)
    return python.parent


@pytest.fixture
def environment(tmp_path: Path, installed: Path) -> dict[str, str]:
    """Environment variables of a user with an empty home, outside the repository."""
    kept = {name: os.environ[name] for name in ("LANG", "TMPDIR") if name in os.environ}
    return kept | {"PATH": f"{installed}:/usr/bin:/bin", "HOME": str(tmp_path), "NO_COLOR": "1", "COLUMNS": "200"}


@pytest.fixture
def address(installed: Path, environment: dict[str, str], tmp_path: Path) -> Iterator[str]:
    process = subprocess.Popen(
        [installed / "bunraku", "up", "--demo", "--port", "0", "--data", tmp_path / "data"],
        stdout=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=environment,
    )
    assert process.stdout is not None
    try:
        found = next(filter(None, (re.search(r"(http://127\.0\.0\.1:\d+)/", line) for line in process.stdout)), None)
        assert found is not None, f"the command ended with {process.wait(HANG_TIMEOUT_S)}"
        yield found[1]
    finally:
        process.terminate()
        process.wait(HANG_TIMEOUT_S)
        process.stdout.close()


def test_wheel_serves_page_and_demo_in_an_empty_environment(
    installed: Path, environment: dict[str, str], tmp_path: Path, address: str
) -> None:
    page = httpx2.get(f"{address}/").text
    scripts = re.findall(r'src="(/assets/[^"]+\.js)"', page)
    assert scripts
    script = httpx2.get(address + scripts[0], headers={"Accept-Encoding": "br"})
    assert (script.status_code, script.headers["content-encoding"]) == (200, "br")
    assert httpx2.get(f"{address}/embed/bunraku-stage.js").status_code == 200
    motions = json.loads(
        run(installed / "bunraku", "list", "--server", address, "--json", cwd=tmp_path, env=environment)
    )
    (demo,) = motions["items"] if isinstance(motions, dict) else motions
    watched = run(
        installed / "bunraku",
        *("watch", demo["id"], "--seconds", 2, "--server", address, "--json"),
        cwd=tmp_path,
        env=environment,
    )
    statistics = json.loads(watched)
    assert statistics["frames"] > 10
    assert statistics["gaps"] == 0


def test_wheel_states_its_licence(installed: Path) -> None:
    code = "from importlib.metadata import metadata; print(metadata('bunraku')['License-Expression'])"
    assert run(installed / "python", "-c", code).strip() == "Apache-2.0"
