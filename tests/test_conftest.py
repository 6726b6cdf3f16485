from __future__ import annotations

import asyncio

import pytest

from tests.conftest import COROUTINE_TIMEOUT_S, fail_after


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
