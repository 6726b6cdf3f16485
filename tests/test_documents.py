"""Documents: examples run as they stand, commands and options exist, links lead to files."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "README.md"
DOCUMENTS = [
    *ROOT.glob("*.md"),
    *(ROOT / "docs").glob("*.md"),
    *(ROOT / "deploy").rglob("*.md"),
    *(ROOT / "proto").glob("*.md"),
    *(ROOT / "examples").rglob("*.md"),
]
MAX_README_WORDS = 1200
COMMAND_GROUPS = ("bench", "capture", "send")
BUNRAKU = Path(sys.executable).parent / "bunraku"


def code_block(document: Path, language: str, containing: str) -> str:
    """Return the only code block of a document in this language that contains a text."""
    blocks = re.findall(rf"```{language}\n(.*?)```", document.read_text(encoding="utf-8"), re.DOTALL)
    (found,) = [block for block in blocks if containing in block]
    return str(found)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "dance.bvh").write_bytes(make_bvh_clip(2.0, 4242))
    return tmp_path


def run_python(code: str, server: str, folder: Path) -> str:
    result = subprocess.run(
        [sys.executable, "-c", code.replace("http://127.0.0.1:8000", server)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=HANG_TIMEOUT_S,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_readme_python_example_shows_frames_and_overlays(server: str, folder: Path) -> None:
    output = run_python(code_block(README, "python", "Puppeteer"), server, folder)
    found = re.search(r"(\d+) frames at [\d.]+ kbit/s, (\d+) overlays", output)
    assert found is not None
    assert int(found[1]) > 10
    assert int(found[2]) > 10


def test_sdk_python_example_records_a_motion(server: str, folder: Path) -> None:
    output = run_python(code_block(ROOT / "docs" / "python-sdk.md", "python", "OneEuro"), server, folder)
    assert re.search(r"recorded \w+", output)


def test_live_python_example_performs_a_motion(server: str, folder: Path) -> None:
    output = run_python(code_block(ROOT / "docs" / "live.md", "python", "client.perform"), server, folder)
    assert re.search(r"\?session=\w+\nmotion \w+", output)


def has_recent_node() -> bool:
    """Return whether Node has a WebSocket client."""
    node = shutil.which("node")
    code = "process.exit(globalThis.WebSocket ? 0 : 1)"
    return node is not None and subprocess.run([node, "-e", code], check=False).returncode == 0


@pytest.mark.skipif(not has_recent_node(), reason="Node 22 is not installed")
def test_live_json_example_performs_a_motion(server: str, folder: Path) -> None:
    script = folder / "performer.mjs"
    code = code_block(ROOT / "docs" / "live.md", "js", "performer.input")
    script.write_text(code.replace("http://127.0.0.1:8000", server))
    ran = subprocess.run(["node", script], capture_output=True, text=True, timeout=HANG_TIMEOUT_S, check=False)
    assert ran.returncode == 0, ran.stderr
    assert re.search(r"motion \w+", ran.stdout)


@pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")
def test_readme_curl_examples_answer(server: str, folder: Path) -> None:
    script = "set -e\n" + code_block(README, "sh", "curl").replace("http://127.0.0.1:8000", server)
    script = script.replace("curl -s", "curl -sf")
    ran = subprocess.run(
        ["bash", "-c", script], cwd=folder, capture_output=True, text=True, timeout=HANG_TIMEOUT_S, check=False
    )
    assert ran.returncode == 0, ran.stderr
    assert '"fps":30' in ran.stdout
    assert '"limbs":[null,null,null,null]' in ran.stdout
    assert '"arms"' in ran.stdout
    size = re.search(r"\}\s*(\d+)\n", ran.stdout)
    assert size is not None
    assert 100 < int(size[1]) < 5000


def documented_commands() -> list[tuple[str, ...]]:
    """Return command and options of every `bunraku` line in the documents' shell blocks."""
    found = set()
    for document in DOCUMENTS:
        for block in re.findall(r"```sh\n(.*?)```", document.read_text(encoding="utf-8"), re.DOTALL):
            for line in re.findall(r"^(?:\w+=\S+ )*bunraku ([^#\n]+)", block, re.MULTILINE):
                words = line.split()
                names = words[:2] if words[0] in COMMAND_GROUPS else words[:1]
                options = sorted(word.partition("=")[0] for word in words if word.startswith("--"))
                found.add((" ".join(names), *options))
    return sorted(found)


@pytest.mark.parametrize("command", documented_commands(), ids=" ".join)
def test_documented_command_exists_with_its_options(command: tuple[str, ...]) -> None:
    names, *options = command
    shown = subprocess.run(
        [BUNRAKU, *names.split(), "--help"], capture_output=True, text=True, timeout=HANG_TIMEOUT_S, check=False
    )
    assert shown.returncode == 0, shown.stderr
    assert [option for option in options if option not in shown.stdout] == []


def test_every_command_is_documented() -> None:
    shown = subprocess.run(
        [BUNRAKU, "--help"], capture_output=True, text=True, timeout=HANG_TIMEOUT_S, check=True
    ).stdout
    commands = set(re.findall(r"^│ ([a-z]+) ", shown.partition("Commands")[2], re.MULTILINE))
    documented = {names.split()[0] for names, *_ in documented_commands()}
    assert commands
    assert commands - documented == set()


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_and_paths_lead_to_files(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    targets = re.findall(r"\]\((?!https?:)([^)#\s]*[./][^)#\s]*)", text)
    assert [target for target in targets if not (document.parent / target).exists()] == []


def test_paths_of_the_package_exist() -> None:
    packages = "|".join(path.name for path in (ROOT / "services" / "bunraku").iterdir() if path.is_dir())
    for document in DOCUMENTS:
        for path in re.findall(rf"`(?:services/bunraku/)?((?:{packages})/[\w/]+\.py)`", document.read_text("utf-8")):
            assert (ROOT / "services" / "bunraku" / path).exists(), f"{document.name}: {path}"


def test_readme_is_short() -> None:
    assert len(README.read_text(encoding="utf-8").split()) <= MAX_README_WORDS
