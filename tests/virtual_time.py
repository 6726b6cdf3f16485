"""Virtual time for a coroutine that must see its steps on time on any machine."""

from __future__ import annotations

import functools
from collections.abc import Callable, Coroutine
from random import Random
from typing import ParamSpec

from tests.simulation.event_loop import VirtualEventLoop

Parameters = ParamSpec("Parameters")

START_US = 1_750_000_000_000_000
"""Clock time at the start."""


def run_in_virtual_time(scenario: Callable[[Callable[[], int]], Coroutine[object, object, None]]) -> None:
    """Run `scenario` in an event loop whose time advances only when nothing is ready.

    `scenario` receives the loop's clock, in microseconds. Fail if nothing handles an exception.
    """
    loop = VirtualEventLoop(Random(1))
    try:
        loop.run_until_complete(scenario(lambda: START_US + loop.now_us))
    finally:
        loop.close()
    assert loop.unhandled == []


def in_virtual_time(test: Callable[Parameters, Coroutine[object, object, None]]) -> Callable[Parameters, None]:
    """Decorate a test, a coroutine, so that it runs in virtual time; its fixtures do not."""

    @functools.wraps(test)
    def run(*arguments: Parameters.args, **options: Parameters.kwargs) -> None:
        run_in_virtual_time(lambda _: test(*arguments, **options))

    return run
