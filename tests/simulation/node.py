"""Simulated processes: each has a clock of its own, can be killed, and owns the tasks that its code starts."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from contextvars import Context, ContextVar, copy_context
from dataclasses import dataclass
from typing import Any, TypeVar

from tests.simulation.event_loop import VirtualEventLoop

EPOCH_US = 1_700_000_000_000_000
"""Reference time at the start of a simulation, microseconds since 1970."""

T = TypeVar("T")
_current_node: ContextVar[Node | None] = ContextVar("node", default=None)


@dataclass(frozen=True, slots=True)
class ClockError:
    """Error of a process's clock."""

    skew_us: int = 0
    drift: float = 0.0
    """Microseconds gained per microsecond."""


class Node:
    """One run of a process. A restarted process is another node."""

    def __init__(self, loop: VirtualEventLoop, name: str, clock_error: ClockError = ClockError()) -> None:
        self.loop = loop
        self.name = name
        self.is_alive = True
        self.on_kill: list[Callable[[], None]] = []
        """Functions that tell other processes of the end: their connections are reset."""
        self.tasks: dict[asyncio.Task[Any], None] = {}
        """Running tasks, in the order of their start."""
        self._clock_error = clock_error
        self.context = copy_context()
        """Context in which all code of the process runs."""
        self.context.run(_current_node.set, self)

    def clock(self) -> int:
        """Return the reference time as this process knows it, microseconds since 1970."""
        error = self._clock_error
        return EPOCH_US + error.skew_us + self.loop.now_us + int(error.drift * self.loop.now_us)

    def start(self, coroutine: Coroutine[Any, Any, T], name: str = "") -> asyncio.Task[T]:
        """Start a task of this process."""
        return self.context.copy().run(self.loop.create_task, coroutine, name=name or None)

    def call(self, function: Callable[..., T], *args: Any) -> T:
        """Call a function as code of this process."""
        return self.context.copy().run(function, *args)

    def call_later(self, delay_us: int, function: Callable[..., None], *args: Any) -> asyncio.TimerHandle:
        """Call a function of this process after a virtual delay."""
        return self.loop.call_at((self.loop.now_us + delay_us) * 1e-6, function, *args, context=self.context)

    def require_alive(self) -> None:
        """Raise `asyncio.CancelledError` in code of a process that was killed: it has no effect any more."""
        if not self.is_alive:
            raise asyncio.CancelledError

    def kill(self) -> None:
        """End the process without letting it do anything more.

        Its tasks are cancelled, so that none is left behind; what their clean-up sends is discarded.
        """
        self.is_alive = False
        for notify in self.on_kill:
            notify()
        self.loop.cancel_timers(lambda context: context.get(_current_node) is self)
        for task in tuple(self.tasks):
            task.cancel()


def install_task_factory(loop: VirtualEventLoop) -> None:
    """Let each task belong to the process whose code creates it."""

    def create_task(
        loop: asyncio.AbstractEventLoop, coroutine: Coroutine[Any, Any, T], context: Context | None = None
    ) -> asyncio.Task[T]:
        task = asyncio.Task(coroutine, loop=loop, context=context)
        node = (context or copy_context()).get(_current_node)
        if node is not None:
            node.tasks[task] = None
            task.add_done_callback(node.tasks.pop)
        return task

    loop.set_task_factory(create_task)  # type: ignore[arg-type]


def current_node() -> Node | None:
    """Return the process whose code runs, None for the simulation itself."""
    return _current_node.get()
