"""What tests of many rooms share."""

from __future__ import annotations

import os
import tempfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import hypothesis
import pytest
from httpx2._config import DEFAULT_TIMEOUT_CONFIG

from tests.servers import make_bvh_clip, run_server

# how long an example takes says more of the machine than of the code
hypothesis.settings.register_profile("bunraku", deadline=None)
hypothesis.settings.load_profile("bunraku")

# so does how long a server of the tests takes to answer; five seconds are for who waits at a screen
DEFAULT_TIMEOUT_CONFIG.read = 60.0

REPOSITORY = Path(__file__).resolve().parent.parent


SUMMARY_LINES = pytest.StashKey[list[str]]()


@pytest.fixture
def tally(pytestconfig: pytest.Config) -> Callable[[str], None]:
    """Says a line at the end of the run, when all is well too."""
    return pytestconfig.stash.setdefault(SUMMARY_LINES, []).append


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Hands on what this process counted, where it is one of several."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["counted"] = session.config.stash.get(SUMMARY_LINES, [])


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Takes in what a process of several counted, when it has ended."""
    counted = getattr(node, "workeroutput", {}).get("counted", [])
    node.config.stash.setdefault(SUMMARY_LINES, []).extend(counted)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Prints what tests counted."""
    lines = config.stash.get(SUMMARY_LINES, [])
    if lines:
        terminalreporter.section("counted")
        for line in lines:
            terminalreporter.line(line)


@pytest.fixture(scope="session", autouse=True)
def _own_temporary_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What servers put away for a while lies in a folder of this process, where tests see that nothing is left."""
    with pytest.MonkeyPatch.context() as patch:
        folder = str(tmp_path_factory.mktemp("away"))
        patch.setenv("TMPDIR", folder)
        patch.setattr(tempfile, "tempdir", folder)
        yield


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of real clips, links and studies that stands beside the project on some machines."""
    folder = Path(os.environ.get("BUNRAKU_SHARED") or REPOSITORY.parent / "shared")
    if not (folder / "mocap" / "bvh").is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"in CI the real clips must be there: {folder}")
        pytest.skip(f"no real clips at {folder}; set BUNRAKU_SHARED to where they are")
    return folder


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a running server that all tests of this kind share."""
    with run_server(tmp_path_factory.mktemp("server")) as url:
        yield url


@pytest.fixture
def clip_file(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A small motion file, another for every test."""
    path = tmp_path / "clip.bvh"
    path.write_bytes(make_bvh_clip(seed=zlib.crc32(request.node.nodeid.encode()) % 100_000))
    return path
