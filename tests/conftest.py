"""Fixtures and hooks shared by the tests of several packages."""

from __future__ import annotations

import asyncio
import functools
import inspect
import logging
import os
import tempfile
import zlib
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import hypothesis
import pytest
from httpx2._config import DEFAULT_TIMEOUT_CONFIG

from bunraku.client import puppeteer
from bunraku.runtime.settings import Settings
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import COROUTINE_TIMEOUT_S, HANG_TIMEOUT_S

# the duration of an example depends more on the machine than on the code
hypothesis.settings.register_profile("bunraku", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow])
hypothesis.settings.load_profile("bunraku")

# the default of 5 s suits interactive use, not a loaded machine
DEFAULT_TIMEOUT_CONFIG.read = HANG_TIMEOUT_S
puppeteer.ANSWER_TIMEOUT_S = HANG_TIMEOUT_S

# tests choose their settings, whatever the environment has
for field in Settings.model_fields:
    os.environ.pop(f"BUNRAKU_{field.upper()}", None)
# the limit of an upload is in wall time, of which a worker process on a loaded machine gets a small share
os.environ["BUNRAKU_UPLOAD_SECONDS"] = str(HANG_TIMEOUT_S)

REPOSITORY = Path(__file__).resolve().parent.parent

FIRST_PATHS = (
    "attack/test_attacks.py",
    "soak/test_soak.py",
    "simulation",
    "faults/test_killed_server.py",
    "faults/test_abandoned_job.py",
    "deploy/test_nats_cluster.py",
    "e2e",
    "faults",
    "fuzz",
    "deploy",
    "marionette/test_merge_model.py",
    "demo/test_build.py",
    "session",
    "ingest",
    "test_cli.py",
    "client",
    "http",
    "messaging",
)
"""Long test files and folders with long ones. They run first, so that at the end no worker waits for a long file."""
SUMMARY_LINES = pytest.StashKey[list[str]]()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run long files first, and let a coroutine that hangs fail at its step, before the time-out of pytest."""
    items.sort(key=lambda item: _rank_path(item.path))
    for item in items:
        if isinstance(item, pytest.Function) and inspect.iscoroutinefunction(item.obj):
            item.obj = fail_after(item.obj, COROUTINE_TIMEOUT_S)


def _rank_path(path: Path) -> int:
    """Return the place of a test file in the order of `FIRST_PATHS`: that of the file, or else of its folder."""
    relative = path.relative_to(REPOSITORY / "tests")
    for place in (relative.as_posix(), relative.parts[0]):
        if place in FIRST_PATHS:
            return FIRST_PATHS.index(place)
    return len(FIRST_PATHS)


def fail_after(test: Callable[..., Awaitable[None]], timeout_s: float) -> Callable[..., Awaitable[None]]:
    """Return the coroutine function `test` with a time limit."""

    @functools.wraps(test)
    async def limited(*arguments: Any, **options: Any) -> None:
        try:
            async with asyncio.timeout(timeout_s) as limit:
                await test(*arguments, **options)
        except TimeoutError:
            if limit.expired():
                pytest.fail(f"the test did not end within {timeout_s:g} s")
            raise

    return limited


@pytest.fixture
def tally(pytestconfig: pytest.Config) -> Callable[[str], None]:
    """Return a function that adds text to the summary of the test run."""
    return pytestconfig.stash.setdefault(SUMMARY_LINES, []).append


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Pass the summary lines of an xdist worker to the controller."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["counted"] = session.config.stash.get(SUMMARY_LINES, [])


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Collect the summary lines of an xdist worker."""
    lines = getattr(node, "workeroutput", {}).get("counted", [])
    node.config.stash.setdefault(SUMMARY_LINES, []).extend(lines)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Print the summary lines."""
    lines = config.stash.get(SUMMARY_LINES, [])
    if lines:
        terminalreporter.section("counted")
        for line in lines:
            terminalreporter.line(line)


@pytest.fixture(scope="session", autouse=True)
def _own_temporary_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Give each test process its own folder for temporary files, so that tests can check that none is left behind."""
    with pytest.MonkeyPatch.context() as patch:
        folder = str(tmp_path_factory.mktemp("temporary"))
        patch.setenv("TMPDIR", folder)
        patch.setattr(tempfile, "tempdir", folder)
        yield


class _UncaughtExceptions(logging.Handler):
    """Handler that keeps what the event loop reports of callbacks and protocols.

    Exceptions of tasks and futures are reported when these are freed, maybe during another test.
    """

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.reports: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        report = self.format(record)
        if report.startswith(("Exception in callback", "Fatal error")):
            self.reports.append(report)


@pytest.fixture(autouse=True)
def _no_uncaught_exception() -> Iterator[None]:
    """Fail a test in which only the event loop caught an exception, of a callback or a protocol.

    Clients see nothing of most of them.
    """
    handler = _UncaughtExceptions()
    logger = logging.getLogger("asyncio")
    logger.addHandler(handler)
    yield
    logger.removeHandler(handler)
    assert not handler.reports, "\n".join(handler.reports)


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the folder with recorded clips, link simulations and studies; skip the test without it, fail in CI."""
    folder = Path(os.environ.get("BUNRAKU_SHARED") or REPOSITORY.parent / "shared")
    if not (folder / "mocap" / "bvh").is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"recorded clips are missing in CI: {folder}")
        pytest.skip(f"no recorded clips at {folder}; set BUNRAKU_SHARED to their folder")
    return folder


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Return the address of a server that the tests of this session share."""
    with run_server(tmp_path_factory.mktemp("server")) as url:
        yield url


@pytest.fixture
def clip_file(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """Return a small motion file that differs from test to test."""
    path = tmp_path / "clip.bvh"
    path.write_bytes(make_bvh_clip(seed=zlib.crc32(request.node.nodeid.encode()) % 100_000))
    return path
