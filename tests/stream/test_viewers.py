from __future__ import annotations

import asyncio

import numpy as np
import pytest

from bunraku.backing.backing import clock
from bunraku.backing.direct import frame
from bunraku.backing.library import Library, pack, with_audio
from bunraku.backing.sockets import TOO_SLOW, Refusal
from bunraku.codec.encode import encode_motion
from bunraku.codec.scene_encode import encode_scene
from bunraku.ingest.opus import encode_audio
from bunraku.playout import timeline
from bunraku.playout.held import Held
from bunraku.stream.viewers import QUEUE, Viewer
from bunraku.wire.messages import (
    ChannelHeader,
    Choice,
    Data,
    Description,
    Edit,
    Overlay,
    Ping,
    Pong,
    Presence,
    Report,
    TimelineState,
    unpack,
)
from tests.vectors.blocks import wandering_motion
from tests.vectors.scene import camera, light


@pytest.fixture
async def library() -> Library:
    shelf = Library.open("memory:///")
    for name, seconds in (("one", 9.2), ("two", 2.0)):
        encoded = encode_motion(wandering_motion(seconds, 30.0, 9), ladder=(30.0, 5.0), grade="live")
        await shelf.put(name, pack(name, encoded))
    encoded = encode_motion(wandering_motion(2.0, 30.0, 9), ladder=(30.0, 5.0), grade="live")
    scenes = [encode_scene(make(2.0, 30.0), ladder=(20.0, 4.0)) for make in (camera, light)]
    await shelf.put("filmed", pack("filmed", encoded, scenes))
    return shelf


class Line:
    """A line that takes messages, and can be stopped."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.open = asyncio.Event()
        self.open.set()
        self._more = asyncio.Condition()

    async def put(self, message: bytes) -> None:
        await self.open.wait()
        async with self._more:
            self.sent.append(message)
            self._more.notify_all()

    async def count(self, kind: type, number: int) -> list[object]:
        def found() -> list[object]:
            return [m for m in map(unpack, self.sent) if isinstance(m, kind)]

        async with asyncio.timeout(10), self._more:
            await self._more.wait_for(lambda: len(found()) >= number)
        return found()


async def test_another_motion_is_announced_before_its_blocks(library: Library) -> None:
    viewer, line = Viewer(library, None), Line()
    state = timeline.start("one", 9_200_000, clock())
    viewer.timeline(state)
    sending = asyncio.create_task(viewer.send(line.put))
    await line.count(Data, 3)
    viewer.timeline(timeline.change(state, clock(), "two", 2_000_000))
    await line.count(ChannelHeader, 2)
    await line.count(TimelineState, 2)
    sending.cancel()
    kinds = [message[0] for message in line.sent]
    second = len(kinds) - 1 - kinds[::-1].index(1)
    assert kinds[second : second + 3] == [1, 2, 4]


async def test_only_the_newest_overlay_waits(library: Library) -> None:
    viewer, line = Viewer(library, None), Line()
    viewer.timeline(timeline.start("one", 9_200_000, clock()))
    line.open.clear()
    sending = asyncio.create_task(viewer.send(line.put))
    await asyncio.sleep(0)
    for number in range(100):
        message = Overlay(number, 5, {}).pack()
        viewer.overlay(message, frame(message))
    line.open.set()
    overlays = await line.count(Overlay, 1)
    await line.count(Data, 5)
    sending.cancel()
    assert [o.sequence for o in overlays if isinstance(o, Overlay)] == [99]


async def test_one_who_does_not_keep_up_is_told_so(library: Library) -> None:
    viewer, line = Viewer(library, None), Line()
    viewer.timeline(timeline.start("one", 9_200_000, clock()))
    for _ in range(QUEUE + 1):
        viewer.control(Presence(1, [], [None] * 4).pack())
    with pytest.raises(Refusal) as refused:
        await viewer.send(line.put)
    assert refused.value.code == TOO_SLOW


async def test_pings_are_answered_before_blocks(library: Library) -> None:
    viewer, line = Viewer(library, None), Line()
    viewer.timeline(timeline.start("one", 9_200_000, clock()))
    viewer.ping(Ping(1, 2))
    sending = asyncio.create_task(viewer.send(line.put))
    await line.count(Data, 1)
    sending.cancel()
    assert isinstance(unpack(line.sent[0]), Pong)


async def test_reports_change_the_rate(library: Library) -> None:
    viewer, line = Viewer(library, None), Line()
    viewer.timeline(timeline.start("one", 9_200_000, clock()))
    sending = asyncio.create_task(viewer.send(line.put))
    await line.count(Data, 5)
    viewer.report(Report(buffer=3_000_000, hidden=True))
    viewer.timeline(timeline.edit(timeline.start("one", 9_200_000, clock()), clock(), position=6_000_000))
    data = await line.count(Data, 8)
    sending.cancel()
    assert [d.rate for d in data if isinstance(d, Data)][-2:] == [0, 0]


async def test_all_tracks_are_counted_and_sent_the_motion_first(library: Library) -> None:
    viewer, line = Viewer(library, None), Line()
    viewer.timeline(timeline.start("filmed", 2_000_000, clock(), playing=False))
    sending = asyncio.create_task(viewer.send(line.put))
    data = await line.count(Data, 6)
    sending.cancel()
    header = unpack(line.sent[0])
    assert isinstance(header, ChannelHeader)
    assert header.channels == 19 + 3 + 3
    assert [(d.track, d.index, d.rate) for d in data if isinstance(d, Data)] == [
        *((0, 0, 0), (1, 0, 1), (2, 0, 1)),
        *((track, 1, 1) for track in range(3)),
    ]


async def test_only_the_tracks_that_are_wanted_are_sent(library: Library) -> None:
    viewer, line = Viewer(library, None, ("light", "audio")), Line()
    viewer.timeline(timeline.start("filmed", 2_000_000, clock()))
    sending = asyncio.create_task(viewer.send(line.put))
    data = await line.count(Data, 2)
    viewer.ping(Ping(1, 2))
    await line.count(Pong, 1)
    sending.cancel()
    assert [(d.track, d.index) for d in data if isinstance(d, Data)] == [(2, 0), (2, 1)]


async def test_an_overlay_goes_past_the_queue_only_where_nothing_else_waits(library: Library) -> None:
    written: list[bytes] = []
    ready = [True]

    def write(framed: bytes) -> bool:
        if ready[0]:
            written.append(framed)
        return ready[0]

    viewer, line = Viewer(library, None, write=write), Line()
    message = Overlay(1, 5, {}).pack()
    # nothing was said yet: the Description must come first
    viewer.overlay(message, frame(message))
    assert written == []
    viewer.timeline(timeline.start("two", 2_000_000, clock()))
    sending = asyncio.create_task(viewer.send(line.put))
    await line.count(Overlay, 1)
    await line.count(Data, 2)
    async with asyncio.timeout(10):
        while not viewer._resting:  # noqa: ASYNC110
            await asyncio.sleep(0)
    viewer.overlay(message, frame(message))
    assert written == [frame(message)]
    # a presence that waits goes before it
    viewer.control(Presence(1, [], [None] * 4).pack())
    viewer.overlay(message, frame(message))
    assert len(written) == 1
    before = len(line.sent)
    await line.count(Presence, 1)
    await line.count(Overlay, 2)
    assert [type(unpack(m)) for m in line.sent[before:]][:2] == [Presence, Overlay]
    ready[0] = False
    viewer.overlay(message, frame(message))
    await line.count(Overlay, 3)
    sending.cancel()
    await asyncio.gather(sending, return_exceptions=True)


@pytest.fixture
async def sounding(library: Library) -> Library:
    """With a motion "sung" of 9.2 s that has noise beside it."""
    stored = await library.get("one")
    assert stored is not None
    noise = np.random.default_rng(2).normal(0, 0.2, (441_600, 1)).astype(np.float32)
    packed, _ = with_audio("sung", stored, encode_audio([noise], stored.track, 1))
    await library.put("sung", packed)
    return library


async def sent_of(viewer: Viewer, count: int) -> list[tuple[int, int, int]]:
    line = Line()
    viewer.timeline(timeline.start("sung", 9_200_000, clock()))
    sending = asyncio.create_task(viewer.send(line.put))
    data = [m for m in await line.count(Data, count) if isinstance(m, Data)]
    sending.cancel()
    header = unpack(line.sent[0])
    assert isinstance(header, ChannelHeader)
    assert header.channels == 20
    return [(m.track, m.index, m.rate) for m in data[:count]]


async def test_sound_goes_with_the_dance_at_its_lowest_until_the_line_has_shown_itself(sounding: Library) -> None:
    sent = await sent_of(Viewer(sounding, None), 10)
    assert sent == [(0, 0, 0), (1, 0, 0), *((track, index, 1 - track) for index in range(1, 5) for track in (0, 1))]


async def test_a_pinned_rate_pins_the_dance_and_the_sound_goes_with_the_line(sounding: Library) -> None:
    viewer = Viewer(sounding, 1)
    assert (await sent_of(viewer, 4))[2:] == [(0, 1, 1), (1, 1, 0)]
    choice = viewer._rate
    assert choice is not None
    for second in range(1, 9):
        choice.report(Report(buffer=4_000_000), clock() + second * 2_000_000)
    assert viewer._steps[choice.rate][:2] == (1, 2)
    assert (await sent_of(Viewer(sounding, 0), 4))[2:] == [(0, 1, 0), (1, 1, 0)]


async def test_who_wants_no_sound_gets_none_and_who_wants_it_alone_gets_that(sounding: Library) -> None:
    assert {track for track, _, _ in await sent_of(Viewer(sounding, None, ("motion",)), 5)} == {0}
    assert await sent_of(Viewer(sounding, None, ("audio",)), 5) == [(1, index, 0) for index in range(5)]


async def test_a_line_that_does_not_carry_both_gets_the_dance_alone(sounding: Library) -> None:
    viewer, line = Viewer(sounding, None), Line()
    viewer.timeline(timeline.start("sung", 9_200_000, clock()))
    sending = asyncio.create_task(viewer.send(line.put))
    await line.count(Data, 10)
    choice = viewer._rate
    assert choice is not None
    for second in range(1, 6):
        choice.report(Report(buffer=0), clock() + second * 2_000_000)
    sent = len(line.sent)
    viewer.edit(Edit(position=6_000_000))
    await line.count(TimelineState, 2)
    await line.count(Data, 13)
    sending.cancel()
    after = [m for m in map(unpack, line.sent[sent:]) if isinstance(m, Data)]
    assert {(m.track, m.rate) for m in after} == {(0, 0)}


async def test_who_comes_back_is_not_sent_again_what_it_holds(library: Library) -> None:
    viewer, line = Viewer(library, None, held=Held("one", 0, (1, 1, -1, 0))), Line()
    viewer.timeline(timeline.start("one", 9_200_000, clock(), playing=False))
    sending = asyncio.create_task(viewer.send(line.put))
    await line.count(Choice, 1)
    sending.cancel()
    assert [message[0] for message in line.sent[:2]] == [1, 4]
    data = [Data.unpack(message) for message in line.sent if message[0] == Data.TYPE]
    assert {(d.index, d.rate) for d in data if d.index < 4} == {(2, 1), (3, 1)}


async def test_held_blocks_of_another_motion_are_no_matter(library: Library) -> None:
    viewer, line = Viewer(library, None, held=Held("two", 0, (1, 1))), Line()
    viewer.timeline(timeline.start("one", 9_200_000, clock(), playing=False))
    sending = asyncio.create_task(viewer.send(line.put))
    data = await line.count(Data, 2)
    sending.cancel()
    assert [message[0] for message in line.sent[:3]] == [1, 2, 4]
    assert [d.index for d in data if isinstance(d, Data)][:2] == [0, 1]


async def test_a_viewer_is_told_once_what_was_chosen_and_why(library: Library) -> None:
    viewer, line = Viewer(library, 0), Line()
    viewer.timeline(timeline.start("one", 9_200_000, clock(), playing=False))
    sending = asyncio.create_task(viewer.send(line.put))
    choices = await line.count(Choice, 1)
    viewer.ping(Ping(1, 2))
    await line.count(Pong, 1)
    sending.cancel()
    assert choices == [Choice(0, "pinned")]
    assert sum(message[0] == Choice.TYPE for message in line.sent) == 1


async def test_tracks_after_the_last_wanted_one_are_not_described(library: Library) -> None:
    described = []
    for wanted in (("motion",), ("motion", "camera"), ("motion", "camera", "light")):
        viewer, line = Viewer(library, None, wanted), Line()
        viewer.timeline(timeline.start("filmed", 2_000_000, clock(), playing=False))
        sending = asyncio.create_task(viewer.send(line.put))
        described += await line.count(Description, 1)
        sending.cancel()
    kinds = [[track["type"] for track in d.tracks] for d in described if isinstance(d, Description)]
    assert kinds == [["motion"], ["motion", "camera"], ["motion", "camera", "light"]]
