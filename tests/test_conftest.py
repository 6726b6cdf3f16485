from __future__ import annotations

import asyncio
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY, fail_after
from tests.time_limit import COROUTINE_TIMEOUT_S

HANGING_TESTS = """
import asyncio, threading, pytest

@pytest.mark.timeout(0.2)
def test_function():
    threading.Event().wait()

@pytest.mark.timeout(0.2)
async def test_coroutine_that_blocks_its_loop():
    threading.Event().wait()

@pytest.fixture
async def hanging():
    await asyncio.Event().wait()

@pytest.mark.timeout(0.2)
async def test_fixture(hanging):
    pass

async def test_after_them():
    await asyncio.sleep(0)
"""


def test_time_out_fails_one_test_and_names_it(tmp_path: Path) -> None:
    (tmp_path / "test_hanging.py").write_text(HANGING_TESTS)
    options = ["-c", str(REPOSITORY / "pyproject.toml"), "--rootdir", str(tmp_path), "-p", "no:cacheprovider"]
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", *options, str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert "2 failed, 1 passed, 1 error" in ran.stdout, ran.stdout + ran.stderr
    failed = re.findall(r"^(FAILED|ERROR) \S*::(\w+)", ran.stdout, re.MULTILINE)
    assert sorted(failed) == [
        ("ERROR", "test_fixture"),
        ("FAILED", "test_coroutine_that_blocks_its_loop"),
        ("FAILED", "test_function"),
    ]


async def test_coroutine_that_hangs_fails_with_the_limit() -> None:
    async def hang() -> None:
        await asyncio.Event().wait()

    with pytest.raises(pytest.fail.Exception, match=r"did not end within 0\.01 s"):
        await fail_after(hang, 0.01)()


async def test_time_limit_of_the_test_itself_is_an_ordinary_error() -> None:
    async def wait() -> None:
        async with asyncio.timeout(0.01):
            await asyncio.Event().wait()

    with pytest.raises(TimeoutError):
        await fail_after(wait, COROUTINE_TIMEOUT_S)()


def test_coroutines_have_the_limit(request: pytest.FixtureRequest) -> None:
    (limited,) = (
        item for item in request.session.items if item.name == "test_coroutine_that_hangs_fails_with_the_limit"
    )
    assert isinstance(limited, pytest.Function)
    assert limited.obj.__wrapped__.__name__ == limited.name
