from __future__ import annotations

import asyncio

import pytest

from bunraku.runtime.input_scheduler import InputScheduler


class Clock:
    """Clock that handlers advance, microseconds."""

    def __init__(self) -> None:
        self.now = 0

    def __call__(self) -> int:
        return self.now


class Connection:
    """Handler whose input takes `pieces` turns of `cost_us` microseconds each."""

    def __init__(
        self, name: str, source: str, handled: list[str], clock: Clock, pieces: int = 1, cost: int = 0
    ) -> None:
        self.name, self.source, self.pieces, self.cost_us = name, source, pieces, cost
        self._handled, self._clock = handled, clock
        self.is_reading = True
        self.is_aborted = False

    def handle_input(self) -> bool:
        self._handled.append(self.name)
        self._clock.now += self.cost_us
        self.pieces -= 1
        if self.pieces < 0:
            raise ValueError("no input")
        return self.pieces > 0

    def pause_reading(self) -> None:
        self.is_reading = False

    def resume_reading(self) -> None:
        self.is_reading = True

    def abort(self) -> None:
        self.is_aborted = True


async def test_input_is_handled_at_once_until_the_time_of_the_iteration_is_over() -> None:
    clock, handled = Clock(), list[str]()
    scheduler = InputScheduler(1_000, clock)
    connections = [Connection(str(number), "a", handled, clock, cost=400) for number in range(7)]
    for connection in connections:
        scheduler.schedule(connection)
    # the third one begins within the time
    assert handled == ["0", "1", "2"]
    assert [connection.is_reading for connection in connections] == [True] * 3 + [False] * 4
    await asyncio.sleep(0)
    assert handled == ["0", "1", "2", "3", "4", "5"]
    await asyncio.sleep(0)
    assert handled[6:] == ["6"]
    assert all(connection.is_reading for connection in connections)
    assert not scheduler.is_busy


async def test_budget_of_zero_handles_one_connection_per_iteration() -> None:
    clock, handled = Clock(), list[str]()
    scheduler = InputScheduler(0, clock)
    for number in range(3):
        scheduler.schedule(Connection(str(number), "a", handled, clock))
    for count in (1, 2, 3):
        assert len(handled) == count
        await asyncio.sleep(0)


async def test_address_with_many_connections_takes_turns_with_others() -> None:
    clock, handled = Clock(), list[str]()
    scheduler = InputScheduler(0, clock)
    for number in range(100):
        scheduler.schedule(Connection(f"flood {number}", "a", handled, clock))
    scheduler.schedule(Connection("viewer", "b", handled, clock))
    for _ in range(3):
        await asyncio.sleep(0)
    assert "viewer" in handled


async def test_connection_with_much_input_takes_turns_with_others() -> None:
    clock, handled = Clock(), list[str]()
    scheduler = InputScheduler(0, clock)
    long = Connection("long", "a", handled, clock, pieces=4)
    scheduler.schedule(long)
    scheduler.schedule(Connection("short", "a", handled, clock))
    while scheduler.is_busy:
        assert not long.is_reading or long.pieces <= 0
        await asyncio.sleep(0)
    assert handled == ["long", "long", "short", "long", "long"]
    assert long.is_reading


async def test_failure_ends_only_its_connection(caplog: pytest.LogCaptureFixture) -> None:
    clock, handled = Clock(), list[str]()
    scheduler = InputScheduler(0, clock)
    scheduler.schedule(Connection("first", "a", handled, clock))
    broken, last = Connection("broken", "a", handled, clock, pieces=0), Connection("last", "a", handled, clock)
    scheduler.schedule(broken)
    scheduler.schedule(last)
    for _ in range(2):
        await asyncio.sleep(0)
    assert broken.is_aborted
    assert handled == ["first", "broken", "last"]
    assert last.is_reading
    assert "no input" in caplog.text
