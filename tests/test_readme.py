"""What the README shows is run as it stands there."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.servers import make_bvh_clip

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(language: str, holding: str) -> str:
    (found,) = [text for text in re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL) if holding in text]
    return str(found)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "dance.bvh").write_bytes(make_bvh_clip(2.0, 4242))
    return tmp_path


def test_the_python_example(server: str, folder: Path) -> None:
    code = block("python", "Puppeteer").replace("http://127.0.0.1:8000", server)
    ran = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, timeout=60, check=False
    )
    assert ran.returncode == 0, ran.stderr
    found = re.search(r"(\d+) frames at [\d.]+ kbit/s, (\d+) overlays", ran.stdout)
    assert found is not None
    assert int(found[1]) > 10
    assert int(found[2]) > 10


@pytest.mark.skipif(shutil.which("curl") is None, reason="this machine has no curl")
def test_the_curl_examples(server: str, folder: Path) -> None:
    script = "set -e\n" + block("sh", "curl").replace("http://127.0.0.1:8000", server).replace("curl -s", "curl -sf")
    ran = subprocess.run(["bash", "-c", script], cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    assert ran.returncode == 0, ran.stderr
    assert '"fps":30' in ran.stdout
    assert '"limbs":[null,null,null,null]' in ran.stdout
    assert '"arms"' in ran.stdout
    size = re.search(r"\}\s*(\d+)\n", ran.stdout)
    assert size is not None
    assert 100 < int(size[1]) < 5000


def test_the_commands_are_there() -> None:
    for line in block("sh", "bunraku up").splitlines():
        command = line.split()[1]
        shown = subprocess.run(
            [Path(sys.executable).parent / "bunraku", command, "--help"], capture_output=True, timeout=60, check=False
        )
        assert shown.returncode == 0


def test_every_path_it_names_is_there() -> None:
    for target in re.findall(r"\]\((?!https:)([^)#]+)\)", README):
        assert (ROOT / target).exists(), target
    for name in re.findall(r"`(motion/\w+\.py)`", README):
        assert (ROOT / "services/bunraku" / name).exists(), name
