"""Cost of idle sessions: requests to a real nats-server do not depend on the number of sessions."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import pytest

from bunraku.playout import timeline
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings
from bunraku.session.session_manager import SessionManager
from bunraku.session.session_registry import SessionRecord, session_key
from tests.processes import nats_url_of, run_jetstream
from tests.time_limit import HANG_TIMEOUT_S

SESSIONS, REPLICAS, HEARTBEATS = 1_000, 4, 4


@pytest.fixture
async def replicas(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> AsyncIterator[list[tuple[SessionManager, Counter[str]]]]:
    """Run session managers, each on a separate connection; count the requests of each by operation."""
    (tmp_path / "nats").mkdir()
    async with AsyncExitStack() as stack:
        server = stack.enter_context(run_jetstream(tmp_path / "nats"))
        managers = []
        for number in range(REPLICAS):
            settings = Settings(data=tmp_path / str(number), bus=nats_url_of(server))
            context = await stack.enter_async_context(open_context(settings))
            managers.append((SessionManager(context), count_requests(context.bus, monkeypatch)))
        yield managers


def count_requests(bus: Any, monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    counts: Counter[str] = Counter()
    request = bus.request

    async def counted(subject: str, *args: Any, **options: Any) -> bytes:
        counts[subject.partition(".")[0] + "." + subject.split(".")[2]] += 1
        answer: bytes = await request(subject, *args, **options)
        return answer

    monkeypatch.setattr(bus, "request", counted)
    return counts


class HeartbeatCount:
    """Number of heartbeats of a replica from now on."""

    def __init__(self, manager: SessionManager) -> None:
        self.number = 0
        self._changed = asyncio.Event()
        manager._registry.replicas.on_heartbeat(self._increment)

    def _increment(self) -> None:
        self.number += 1
        self._changed.set()

    async def wait_for(self, number: int) -> None:
        while self.number < number:
            self._changed.clear()
            await self._changed.wait()


async def test_idle_replicas_send_one_request_per_heartbeat(
    replicas: list[tuple[SessionManager, Counter[str]]], tally: Callable[[str], None]
) -> None:
    owner = replicas[0][0]._registry.replicas
    store = replicas[0][0]._context.key_values
    record = SessionRecord(await owner.register(), 1, timeline.start("m", 1_000_000, 1).pack())
    await asyncio.gather(*(store.put(session_key(f"s{number}"), record.pack(), 0) for number in range(SESSIONS)))
    # the sessions belong to another living replica than those that are measured
    heartbeats = asyncio.create_task(owner.run())
    running = [asyncio.create_task(manager.run()) for manager, _ in replicas[1:]]
    for manager, _ in replicas[1:]:
        await manager._registry.replicas.register()
        assert len(manager._registry.sessions) == SESSIONS
    measured = [(manager, HeartbeatCount(manager), counts, counts.total()) for manager, counts in replicas[1:]]
    async with asyncio.timeout(HANG_TIMEOUT_S):
        for _, sent, _, _ in measured:
            await sent.wait_for(HEARTBEATS)
    requests = sum(counts.total() - before for _, _, counts, before in measured)
    heartbeats_sent = sum(sent.number for _, sent, _, _ in measured)
    for task in (heartbeats, *running):
        task.cancel()
    await asyncio.gather(heartbeats, *running, return_exceptions=True)
    tally(
        f"idle cost: {requests} requests in {heartbeats_sent} heartbeats, {SESSIONS} sessions, {len(measured)} replicas"
    )
    # a heartbeat at the edge of the interval may count on one side only
    assert requests <= heartbeats_sent + len(measured)
    assert not any(manager._claim_tasks or manager.stages for manager, _ in replicas)
