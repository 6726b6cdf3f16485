from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.container import StoredMotion, add_audio_track, pack_motion, unpack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene_encoder import encode_scene
from bunraku.delivery.block_scheduler import SCHEDULING_MARGIN_US
from bunraku.delivery.resume import ResumeState
from bunraku.ingest.jobs.opus import encode_audio
from bunraku.playout import timeline
from bunraku.runtime.clock import clock
from bunraku.stream.context import StreamContext
from bunraku.stream.edit_queue import EDIT_INTERVAL_US
from bunraku.stream.send_queue import MAX_CONTROL_MESSAGES, MAX_PENDING_PINGS
from bunraku.stream.track_selection import ViewerOptions
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.subprotocol import POLICY_VIOLATION, TRY_AGAIN_LATER, CloseConnection
from bunraku.wire.messages import (
    ChannelHeader,
    Choice,
    Data,
    Description,
    Edit,
    Ping,
    Pong,
    Presence,
    Problem,
    Report,
    TimelineState,
)
from bunraku.wire.overlay import Overlay
from tests.stream.fake_transport import FakeTransport, parse_frames
from tests.stream.sync_viewer import VirtualTime
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera, sample_light

PRESENCE = encode_frame(Presence(1, [], [None] * 4).pack())


@pytest.fixture(scope="module")
def motions() -> dict[str, StoredMotion]:
    motions_by_id = {}
    for name, seconds in (("one", 9.2), ("two", 2.0), ("filmed", 2.0)):
        encoded = encode_motion(random_motion(seconds, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
        scenes = [encode_scene(make(2.0, 30.0), error_bounds_mm=(20.0, 4.0)) for make in (sample_camera, sample_light)]
        motions_by_id[name] = unpack_motion(name, pack_motion(name, encoded, scenes if name == "filmed" else ()))
    # "sung" has noise as audio
    noise = np.random.default_rng(2).normal(0, 0.2, (441_600, 1)).astype(np.float32)
    packed, _ = add_audio_track(
        "sung", motions_by_id["one"], encode_audio([noise], motions_by_id["one"].first_track, 1)
    )
    return {**motions_by_id, "sung": unpack_motion("sung", packed)}


def open_viewer(
    motion: StoredMotion, playing: bool = True, now: int | None = None, **options: object
) -> tuple[ViewerConnection, FakeTransport, TimelineState]:
    """Return a viewer with an open connection, its transport, and its timeline."""
    context = StreamContext.create(clock if now is None else lambda: now)
    viewer, transport = ViewerConnection(context, ViewerOptions(**options)), FakeTransport()  # type: ignore[arg-type]
    state = timeline.start(motion.id, motion.first_track.duration_us, context.clock(), playing=playing)
    viewer.set_timeline(state, motion)
    viewer.open(transport.open_connection(viewer))
    return viewer, transport, state


def messages_of_type(kind: type, transport: FakeTransport) -> list[object]:
    return [message for message in transport.messages if isinstance(message, kind)]


def overlay_frame(number: int) -> bytes:
    return encode_frame(Overlay(number, 5, {}).pack())


async def test_queued_messages_leave_in_one_write_when_opened(motions: dict[str, StoredMotion]) -> None:
    viewer, transport = ViewerConnection(StreamContext.create(clock)), FakeTransport()
    viewer.set_timeline(timeline.start("one", 9_200_000, clock()), motions["one"])
    viewer.send_control(PRESENCE)
    viewer.send_newest(overlay_frame(3))
    assert transport.sent == b""
    viewer.open(transport.open_connection(viewer))
    assert transport.writes == 1
    kinds = [type(message).__name__ for message in transport.messages]
    assert kinds[:5] == ["ChannelHeader", "Description", "TimelineState", "Presence", "Overlay"]
    assert set(kinds[5:-1]) == {"Data"}
    assert kinds[-1] == "Choice"


async def test_new_motion_is_announced_before_its_blocks(motions: dict[str, StoredMotion]) -> None:
    viewer, transport, state = open_viewer(motions["one"])
    before = len(transport.messages)
    assert len(messages_of_type(Data, transport)) >= 3
    viewer.set_timeline(timeline.change_motion(state, clock(), "two", 2_000_000), motions["two"])
    viewer.tick()
    kinds = [type(message).__name__ for message in transport.messages[before:]]
    assert kinds[:3] == ["ChannelHeader", "Description", "TimelineState"]
    assert set(kinds[3:-1]) == {"Data"}
    assert kinds[-1] == "Choice"


async def test_only_newest_overlay_is_queued(motions: dict[str, StoredMotion]) -> None:
    viewer, transport, _ = open_viewer(motions["one"])
    viewer.send_newest(overlay_frame(1))
    transport.has_capacity = False
    for number in range(2, 100):
        viewer.send_newest(overlay_frame(number))
    # one is buffered in the transport already
    assert transport.unsent == overlay_frame(2)
    transport.drain()
    assert [o.sequence for o in messages_of_type(Overlay, transport) if isinstance(o, Overlay)] == [1, 2, 99]
    viewer.send_newest(overlay_frame(100))
    assert transport.sent.endswith(overlay_frame(100))


async def test_queued_messages_leave_in_order_of_priority(motions: dict[str, StoredMotion]) -> None:
    viewer, transport, state = open_viewer(motions["one"])
    transport.has_capacity = False
    viewer.send_control(PRESENCE)
    before = len(transport.messages)
    viewer.send_newest(overlay_frame(7))
    viewer.send_control(PRESENCE)
    viewer.set_timeline(timeline.edit(state, clock(), position=8_000_000), motions["one"])
    viewer.on_message(Ping(1, 2).pack())
    viewer.tick()
    transport.drain()
    kinds = [type(message).__name__ for message in transport.messages[before:]]
    assert kinds[:5] == ["Presence", "Pong", "TimelineState", "Presence", "Overlay"]


async def test_full_queue_disconnects_viewer_with_reason(motions: dict[str, StoredMotion]) -> None:
    viewer, transport, _ = open_viewer(motions["one"])
    transport.has_capacity = False
    for _ in range(MAX_CONTROL_MESSAGES + 2):
        viewer.send_control(PRESENCE)
    assert transport.unsent.startswith(PRESENCE)
    transport.drain()
    (problem,) = messages_of_type(Problem, transport)
    assert isinstance(problem, Problem)
    assert problem.title == "Too slow"
    opcode, payload = parse_frames(transport.sent)[-1]
    assert (opcode, int.from_bytes(payload[:2], "big")) == (8, TRY_AGAIN_LATER)


async def test_pings_are_answered_and_queue_of_pings_is_bounded(motions: dict[str, StoredMotion]) -> None:
    viewer, transport, _ = open_viewer(motions["one"])
    viewer.on_message(Ping(1, 2).pack())
    assert isinstance(transport.messages[-1], Pong)
    transport.has_capacity = False
    viewer.send_control(PRESENCE)
    for number in range(2, 30):
        viewer.on_message(Ping(number, 2).pack())
    transport.drain()
    assert [pong.sequence for pong in messages_of_type(Pong, transport) if isinstance(pong, Pong)] == list(
        range(1, MAX_PENDING_PINGS + 2)
    )


async def test_report_changes_level(motions: dict[str, StoredMotion]) -> None:
    viewer, transport, state = open_viewer(motions["one"])
    viewer.on_message(Report(buffer=3_000_000, hidden=True).pack())
    viewer.set_timeline(timeline.edit(state, clock(), position=6_000_000), motions["one"])
    viewer.tick()
    assert [data.rate for data in messages_of_type(Data, transport) if isinstance(data, Data)][-2:] == [0, 0]


async def test_only_own_timeline_can_be_edited(motions: dict[str, StoredMotion]) -> None:
    for has_own_timeline in (True, False):
        viewer, transport, _ = open_viewer(motions["one"], has_own_timeline=has_own_timeline)
        viewer.on_message(Edit(playing=False).pack())
        assert [s.playing for s in messages_of_type(TimelineState, transport) if isinstance(s, TimelineState)] == [
            True,
            False,
        ][: 1 + has_own_timeline]


async def test_edits_in_quick_succession_are_combined(motions: dict[str, StoredMotion]) -> None:
    virtual_time = VirtualTime()
    viewer, transport = ViewerConnection(virtual_time.context, ViewerOptions(has_own_timeline=True)), FakeTransport()
    viewer.set_timeline(timeline.start("one", 9_200_000, virtual_time.now), motions["one"])
    viewer.open(transport.open_connection(viewer))

    def states() -> list[TimelineState]:
        return [state for state in messages_of_type(TimelineState, transport)[1:] if isinstance(state, TimelineState)]

    viewer.on_message(Edit(playing=False, position=1_000_000).pack())
    assert [(state.playing, state.position) for state in states()] == [(False, 1_000_000)]
    for position in range(0, 5_000_000, 1_000):
        viewer.on_message(Edit(position=position).pack())
    viewer.on_message(Edit(playing=True).pack())
    assert len(states()) == 1
    virtual_time.now += EDIT_INTERVAL_US
    viewer.tick()
    # the last value of each field counts
    assert [(state.playing, state.position) for state in states()[1:]] == [(True, 4_999_000)]
    viewer.tick()
    assert len(states()) == 2


@pytest.mark.parametrize("playing", [True, False])
async def test_blocks_of_future_timeline_are_sent_before_it_begins(
    motions: dict[str, StoredMotion], playing: bool
) -> None:
    now = clock()
    viewer, transport, state = open_viewer(motions["one"], playing=playing, now=now)
    before = len(messages_of_type(Data, transport))
    viewer.set_timeline(timeline.edit(state, now + 100_000, position=6_200_000), motions["one"])
    viewer.tick()
    track, sent = motions["one"].first_track, messages_of_type(Data, transport)[before:]
    assert next(message.index for message in sent if isinstance(message, Data)) == track.block_at(6_200_000)
    # the next block comes within reach some time after the timeline has begun
    next_block_at = viewer._feed.next_block_at
    if not playing:
        assert next_block_at is None
        return
    beyond = next(at for at in map(track.start_us, range(track.block_count)) if at > 10_200_000 - track.duration_us)
    assert next_block_at == now + 100_000 + beyond + track.duration_us - 10_200_000 + SCHEDULING_MARGIN_US


async def test_malformed_message_closes_connection(motions: dict[str, StoredMotion]) -> None:
    viewer, _, _ = open_viewer(motions["one"])
    with pytest.raises(CloseConnection) as closed:
        viewer.on_message(b"\x40")
    assert closed.value.code == POLICY_VIOLATION
    viewer.on_message(b"\x7fnews")


async def test_all_tracks_are_sent_with_motion_first(motions: dict[str, StoredMotion]) -> None:
    _, transport, _ = open_viewer(motions["filmed"], playing=False)
    header = transport.messages[0]
    assert isinstance(header, ChannelHeader)
    assert header.channels == 19 + 3 + 3
    assert [(d.track, d.index, d.rate) for d in messages_of_type(Data, transport) if isinstance(d, Data)][:6] == [
        *((0, 0, 0), (1, 0, 1), (2, 0, 1)),
        *((track, 1, 1) for track in range(3)),
    ]


async def test_only_selected_tracks_are_sent(motions: dict[str, StoredMotion]) -> None:
    _, transport, _ = open_viewer(motions["filmed"], track_types=("light", "audio"))
    assert {(d.track, d.index) for d in messages_of_type(Data, transport) if isinstance(d, Data)} == {(2, 0), (2, 1)}


async def test_silent_viewer_is_pinged_once_and_aborted(motions: dict[str, StoredMotion]) -> None:
    time = VirtualTime()
    viewer, transport = ViewerConnection(time.context), FakeTransport()
    viewer.set_timeline(timeline.start("one", 9_200_000, time.now), motions["one"])
    viewer.open(transport.open_connection(viewer))
    for second in range(18):
        time.now = time.start + second * 1_000_000
        viewer.tick()
    assert [opcode for opcode, _ in parse_frames(transport.sent)].count(9) == 1
    assert not transport.aborted
    time.now = time.start + 19_000_000
    viewer.tick()
    assert transport.aborted


async def test_ticks_for_due_blocks_are_spread(motions: dict[str, StoredMotion]) -> None:
    now = clock()
    found = [open_viewer(motions["one"], now=now) for _ in range(50)]
    turns = [viewer._next_tick() - now for viewer, _, _ in found]
    assert all(0 < turn <= 2_000_000 for turn in turns)
    assert len({turn // 100_000 for turn in turns}) > 5


async def test_failing_tick_closes_connection_and_is_logged(
    motions: dict[str, StoredMotion], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    viewer, transport, _ = open_viewer(motions["one"])

    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(ViewerConnection, "_next_tick", broken)
    viewer.tick()
    (problem,) = messages_of_type(Problem, transport)
    assert isinstance(problem, Problem)
    assert problem.title == "Our fault"
    assert "Sending to a viewer failed" in caplog.text


def sent_blocks(transport: FakeTransport) -> list[tuple[int, int, int]]:
    header = transport.messages[0]
    assert isinstance(header, ChannelHeader)
    assert header.channels == 20
    return [(m.track, m.index, m.rate) for m in messages_of_type(Data, transport) if isinstance(m, Data)]


async def test_audio_starts_at_lowest_level(
    motions: dict[str, StoredMotion],
) -> None:
    _, transport, _ = open_viewer(motions["sung"])
    assert sent_blocks(transport)[:8] == [
        *((0, 0, 0), (1, 0, 0)),
        *((track, index, 1 - track) for index in range(1, 4) for track in (0, 1)),
    ]


async def test_pinned_level_applies_to_motion_but_not_to_audio(motions: dict[str, StoredMotion]) -> None:
    for pinned, audio_level, expected in ((1, 2, [(0, 1, 1), (1, 1, 0)]), (0, 0, [(0, 1, 0), (1, 1, 0)])):
        viewer, transport, _ = open_viewer(motions["sung"], pinned_level=pinned)
        assert sent_blocks(transport)[2:4] == expected
        assert viewer._feed.delivery is not None
        selector = viewer._feed.delivery.selector
        for second in range(1, 9):
            selector.process_report(Report(buffer=4_000_000), clock() + second * 2_000_000)
        assert viewer._feed.delivery.allocation[:2] == (pinned, audio_level)


async def test_audio_is_sent_only_if_selected_and_may_be_sent_alone(motions: dict[str, StoredMotion]) -> None:
    _, transport, _ = open_viewer(motions["sung"], track_types=("motion",))
    assert {track for track, _, _ in sent_blocks(transport)} == {0}
    _, transport, _ = open_viewer(motions["sung"], track_types=("audio",))
    assert sent_blocks(transport)[:4] == [(1, index, 0) for index in range(4)]


async def test_empty_buffer_drops_audio_before_motion(motions: dict[str, StoredMotion]) -> None:
    viewer, transport, _ = open_viewer(motions["sung"], has_own_timeline=True)
    assert viewer._feed.delivery is not None
    delivery = viewer._feed.delivery
    for second in range(1, 6):
        delivery.process_report(Report(buffer=0), clock() + second * 2_000_000)
    before = len(sent_blocks(transport))
    viewer.on_message(Edit(position=6_000_000).pack())
    viewer.tick()
    after = sent_blocks(transport)[before:]
    assert after
    assert {(track, rate) for track, _, rate in after} == {(0, 0)}


async def test_resuming_viewer_is_not_sent_blocks_it_holds(motions: dict[str, StoredMotion]) -> None:
    _, transport, _ = open_viewer(motions["one"], playing=False, resume_state=ResumeState("one", 0, (1, 1, -1, 0)))
    assert [type(message) for message in transport.messages[:2]] == [ChannelHeader, TimelineState]
    data = [message for message in transport.messages if isinstance(message, Data)]
    assert {(d.index, d.rate) for d in data if d.index < 4} == {(2, 1), (3, 1)}


async def test_resume_state_of_another_motion_is_ignored(motions: dict[str, StoredMotion]) -> None:
    _, transport, _ = open_viewer(motions["one"], playing=False, resume_state=ResumeState("two", 0, (1, 1)))
    assert [type(message) for message in transport.messages[:3]] == [ChannelHeader, Description, TimelineState]
    assert [message.index for message in transport.messages if isinstance(message, Data)][:2] == [0, 1]


async def test_unchanged_choice_is_sent_once(motions: dict[str, StoredMotion]) -> None:
    viewer, transport, _ = open_viewer(motions["one"], playing=False, pinned_level=0)
    viewer.on_message(Ping(1, 2).pack())
    viewer.tick()
    assert messages_of_type(Choice, transport) == [Choice(0, "pinned")]


async def test_choice_is_sent_when_reason_changes(motions: dict[str, StoredMotion]) -> None:
    viewer, transport, _ = open_viewer(motions["one"], playing=False)
    for hidden in (True, True, False):
        viewer.on_message(Report(buffer=3_000_000, hidden=hidden).pack())
        viewer.tick()
    assert [choice.reason for choice in messages_of_type(Choice, transport) if isinstance(choice, Choice)] == [
        "best",
        "hidden",
        "best",
    ]


async def test_tracks_after_last_selected_one_are_not_described(motions: dict[str, StoredMotion]) -> None:
    kinds = []
    for track_types in (("motion",), ("motion", "camera"), ("motion", "camera", "light")):
        _, transport, _ = open_viewer(motions["filmed"], playing=False, track_types=track_types)
        (described,) = messages_of_type(Description, transport)
        assert isinstance(described, Description)
        kinds.append([track["type"] for track in described.tracks])
    assert kinds == [["motion"], ["motion", "camera"], ["motion", "camera", "light"]]
