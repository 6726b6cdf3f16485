from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from itertools import count

import pytest

from bunraku.messaging.bus import MemoryBus
from bunraku.playout import timeline
from bunraku.runtime.clock import clock
from bunraku.runtime.input_scheduler import InputScheduler
from bunraku.session import puppeteer_input
from bunraku.session.puppeteer_input import PuppeteerInput
from bunraku.session.session_start import SessionStart
from bunraku.session.stage import Stage
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Claim, Refusal, unpack
from tests.session.joined_stage import JoinedPuppeteer, join_stage, stored_motion

MESSAGES_PER_ITERATION = 5


@pytest.fixture
async def stage() -> AsyncIterator[Stage]:
    motion = stored_motion("one", 1)
    state = timeline.start("one", motion.first_track.duration_us, clock())
    opened = Stage(SessionStart("s", motion, state, state.clock), MemoryBus(), clock)
    yield opened
    await opened.close()


@pytest.fixture
def scheduler() -> InputScheduler:
    """A scheduler on whose clock each message takes a fifth of an iteration's time."""
    return InputScheduler(1_000, count(0, 1_000 // MESSAGES_PER_ITERATION).__next__)


async def finish(scheduler: InputScheduler) -> None:
    while scheduler.is_busy:  # noqa: ASYNC110
        await asyncio.sleep(0)


def refusals(joined: JoinedPuppeteer) -> int:
    return sum(isinstance(unpack(message), Refusal) for message in joined.received if message)


async def test_bursts_of_many_puppeteers_are_spread_over_iterations(stage: Stage, scheduler: InputScheduler) -> None:
    holder = join_stage(stage, "Holder")
    stage.receive(holder.puppeteer, Claim(0))
    joined = [join_stage(stage, f"P{number}") for number in range(4)]
    inputs = [PuppeteerInput(one.puppeteer, stage, scheduler) for one in joined]
    for one in inputs:
        for _ in range(10):
            one.add(Claim(0).pack())
    handled = [sum(map(refusals, joined))]
    while handled[-1] < 40:
        await asyncio.sleep(0)
        handled.append(sum(map(refusals, joined)))
    steps = [later - earlier for earlier, later in zip([0, *handled], handled, strict=False)]
    assert max(steps) <= MESSAGES_PER_ITERATION
    # the first had its turn before the burst of the others; they take turns
    assert [refusals(one) for one in joined] == [10] * 4


async def test_calm_puppeteer_waits_for_no_burst(stage: Stage, scheduler: InputScheduler) -> None:
    flooder, calm = join_stage(stage, "Flooder"), join_stage(stage, "Calm")
    flood = PuppeteerInput(flooder.puppeteer, stage, scheduler)
    for _ in range(1_000):
        flood.add(Claim(0).pack())
    PuppeteerInput(calm.puppeteer, stage, scheduler).add(Claim(1).pack())
    await asyncio.sleep(0)
    assert stage.holders[1] == calm.id


async def test_messages_are_applied_in_order_and_leaving_is_the_last(stage: Stage, scheduler: InputScheduler) -> None:
    leaving, other = join_stage(stage, "Leaving"), join_stage(stage, "Other")
    waiting = PuppeteerInput(leaving.puppeteer, stage, scheduler)
    for _ in range(MESSAGES_PER_ITERATION):
        waiting.add(Claim(0).pack())
    waiting.add(Claim(1).pack())
    waiting.add(None)
    waiting.add(Claim(2).pack())
    assert stage.puppeteers.get(leaving.id) is not None
    await finish(scheduler)
    assert stage.puppeteers.get(leaving.id) is None
    assert stage.holders == (None,) * 4
    assert stage.puppeteers.get(other.id) is not None


async def test_too_many_messages_end_the_puppeteer(
    stage: Stage, scheduler: InputScheduler, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(puppeteer_input, "MAX_WAITING_MESSAGES", 20)
    joined = join_stage(stage, "Flooder")
    flood = PuppeteerInput(joined.puppeteer, stage, scheduler)
    for _ in range(40):
        flood.add(Claim(0).pack())
    assert b"" in joined.received
    await finish(scheduler)
    assert stage.puppeteers.get(joined.id) is None
    assert stage.holders[0] is None


async def test_message_that_cannot_be_applied_ends_the_puppeteer(stage: Stage, scheduler: InputScheduler) -> None:
    joined = join_stage(stage, "Broken")
    broken = PuppeteerInput(joined.puppeteer, stage, scheduler)
    with pytest.raises(MalformedMessage):
        broken.add(Claim(0).pack()[:1])
    assert joined.received[-1] == b""
    assert stage.puppeteers.get(joined.id) is None
