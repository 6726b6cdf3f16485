from __future__ import annotations

import numpy as np
import pytest

from bunraku.backing.backing import clock
from bunraku.backing.frames import frame
from bunraku.backing.library import StoredMotion, pack, unpack, with_audio
from bunraku.backing.sockets import BROKEN, TOO_SLOW, Refusal
from bunraku.codec.encode import encode_motion
from bunraku.codec.scene_encode import encode_scene
from bunraku.ingest.opus import encode_audio
from bunraku.playout import timeline
from bunraku.playout.held import Held
from bunraku.playout.pacing import MARGIN
from bunraku.stream import viewers
from bunraku.stream.pending import PINGS, QUEUE
from bunraku.stream.turns import Turns
from bunraku.stream.viewers import Viewer
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
from tests.stream.lines import Line, frames
from tests.vectors.blocks import wandering_motion
from tests.vectors.scene import camera, light

PRESENCE = frame(Presence(1, [], [None] * 4).pack())


@pytest.fixture(scope="module")
def motions() -> dict[str, StoredMotion]:
    shelf = {}
    for name, seconds in (("one", 9.2), ("two", 2.0), ("filmed", 2.0)):
        encoded = encode_motion(wandering_motion(seconds, 30.0, 9), ladder=(30.0, 5.0), grade="live")
        scenes = [encode_scene(make(2.0, 30.0), ladder=(20.0, 4.0)) for make in (camera, light)]
        shelf[name] = unpack(name, pack(name, encoded, scenes if name == "filmed" else ()))
    # "sung", with noise beside it
    noise = np.random.default_rng(2).normal(0, 0.2, (441_600, 1)).astype(np.float32)
    packed, _ = with_audio("sung", shelf["one"], encode_audio([noise], shelf["one"].track, 1))
    return {**shelf, "sung": unpack("sung", packed)}


def watching(
    motion: StoredMotion, playing: bool = True, now: int | None = None, **options: object
) -> tuple[Viewer, Line, TimelineState]:
    """A viewer of a motion whose line is open, and the timeline that it was given at `now`."""
    viewer, line = Viewer(Turns(), **options), Line()  # type: ignore[arg-type]
    state = timeline.start(motion.id, motion.track.duration_us, clock() if now is None else now, playing=playing)
    viewer.timeline(state, motion)
    viewer.open(line.outlet(viewer))
    return viewer, line, state


def of(kind: type, line: Line) -> list[object]:
    return [message for message in line.messages if isinstance(message, kind)]


def overlay(number: int) -> bytes:
    return frame(Overlay(number, 5, {}).pack())


async def test_all_that_is_known_leaves_in_one_piece(motions: dict[str, StoredMotion]) -> None:
    viewer, line = Viewer(Turns()), Line()
    viewer.timeline(timeline.start("one", 9_200_000, clock()), motions["one"])
    viewer.control(PRESENCE)
    viewer.overlay(overlay(3))
    assert line.sent == b""
    viewer.open(line.outlet(viewer))
    assert line.writes == 1
    kinds = [type(message).__name__ for message in line.messages]
    assert kinds[:5] == ["ChannelHeader", "Description", "TimelineState", "Presence", "Overlay"]
    assert set(kinds[5:-1]) == {"Data"}
    assert kinds[-1] == "Choice"


async def test_another_motion_is_announced_before_its_blocks(motions: dict[str, StoredMotion]) -> None:
    viewer, line, state = watching(motions["one"])
    before = len(line.messages)
    assert len(of(Data, line)) >= 3
    viewer.timeline(timeline.change(state, clock(), "two", 2_000_000), motions["two"])
    viewer.advance()
    kinds = [type(message).__name__ for message in line.messages[before:]]
    assert kinds[:3] == ["ChannelHeader", "Description", "TimelineState"]
    assert set(kinds[3:-1]) == {"Data"}
    assert kinds[-1] == "Choice"


async def test_only_the_newest_overlay_waits(motions: dict[str, StoredMotion]) -> None:
    viewer, line, _ = watching(motions["one"])
    viewer.overlay(overlay(1))
    line.room = False
    for number in range(2, 100):
        viewer.overlay(overlay(number))
    # one is in the transport already
    assert line.waiting == overlay(2)
    line.drain()
    assert [o.sequence for o in of(Overlay, line) if isinstance(o, Overlay)] == [1, 2, 99]
    viewer.overlay(overlay(100))
    assert line.sent.endswith(overlay(100))


async def test_what_waits_leaves_in_order(motions: dict[str, StoredMotion]) -> None:
    viewer, line, state = watching(motions["one"])
    line.room = False
    viewer.control(PRESENCE)
    before = len(line.messages)
    viewer.overlay(overlay(7))
    viewer.control(PRESENCE)
    viewer.timeline(timeline.edit(state, clock(), position=8_000_000), motions["one"])
    viewer.hear(Ping(1, 2).pack())
    viewer.advance()
    line.drain()
    kinds = [type(message).__name__ for message in line.messages[before:]]
    assert kinds[:5] == ["Presence", "Pong", "TimelineState", "Presence", "Overlay"]


async def test_one_who_does_not_keep_up_is_told_so(motions: dict[str, StoredMotion]) -> None:
    viewer, line, _ = watching(motions["one"])
    line.room = False
    for _ in range(QUEUE + 2):
        viewer.control(PRESENCE)
    assert line.waiting.startswith(PRESENCE)
    line.drain()
    (problem,) = of(Problem, line)
    assert isinstance(problem, Problem)
    assert problem.title == "Too slow"
    opcode, payload = frames(line.sent)[-1]
    assert (opcode, int.from_bytes(payload[:2], "big")) == (8, TOO_SLOW)


async def test_pings_are_answered_and_only_some_wait(motions: dict[str, StoredMotion]) -> None:
    viewer, line, _ = watching(motions["one"])
    viewer.hear(Ping(1, 2).pack())
    assert isinstance(line.messages[-1], Pong)
    line.room = False
    viewer.control(PRESENCE)
    for number in range(2, 30):
        viewer.hear(Ping(number, 2).pack())
    line.drain()
    assert [pong.sequence for pong in of(Pong, line) if isinstance(pong, Pong)] == list(range(1, PINGS + 2))


async def test_reports_change_the_rate(motions: dict[str, StoredMotion]) -> None:
    viewer, line, state = watching(motions["one"])
    viewer.hear(Report(buffer=3_000_000, hidden=True).pack())
    viewer.timeline(timeline.edit(state, clock(), position=6_000_000), motions["one"])
    viewer.advance()
    assert [data.rate for data in of(Data, line) if isinstance(data, Data)][-2:] == [0, 0]


async def test_private_timelines_are_edited_others_not(motions: dict[str, StoredMotion]) -> None:
    for private in (True, False):
        viewer, line, _ = watching(motions["one"], private=private)
        viewer.hear(Edit(playing=False).pack())
        assert [s.playing for s in of(TimelineState, line) if isinstance(s, TimelineState)] == [True, False][
            : 1 + private
        ]


@pytest.mark.parametrize("playing", [True, False])
async def test_what_a_timeline_begins_with_goes_though_it_lies_a_little_ahead(
    motions: dict[str, StoredMotion], monkeypatch: pytest.MonkeyPatch, playing: bool
) -> None:
    now = clock()
    monkeypatch.setattr(viewers, "clock", lambda: now)
    viewer, line, state = watching(motions["one"], playing=playing, now=now)
    before = len(of(Data, line))
    viewer.timeline(timeline.edit(state, now + 100_000, position=6_200_000), motions["one"])
    viewer.advance()
    track, sent = motions["one"].track, of(Data, line)[before:]
    assert next(message.index for message in sent if isinstance(message, Data)) == track.block_at(6_200_000)
    # the next comes within reach when the stage has begun and gone so far
    following = viewer._following
    if not playing:
        assert following is None
        return
    beyond = next(at for at in map(track.start_us, range(track.blocks)) if at > 10_200_000 - track.duration_us)
    assert following == now + 100_000 + beyond + track.duration_us - 10_200_000 + MARGIN


async def test_what_is_malformed_is_refused(motions: dict[str, StoredMotion]) -> None:
    viewer, _, _ = watching(motions["one"])
    with pytest.raises(Refusal) as refused:
        viewer.hear(b"\x40")
    assert refused.value.code == BROKEN
    viewer.hear(b"\x7fnews")


async def test_all_tracks_are_counted_and_sent_the_motion_first(motions: dict[str, StoredMotion]) -> None:
    _, line, _ = watching(motions["filmed"], playing=False)
    header = line.messages[0]
    assert isinstance(header, ChannelHeader)
    assert header.channels == 19 + 3 + 3
    assert [(d.track, d.index, d.rate) for d in of(Data, line) if isinstance(d, Data)][:6] == [
        *((0, 0, 0), (1, 0, 1), (2, 0, 1)),
        *((track, 1, 1) for track in range(3)),
    ]


async def test_only_the_tracks_that_are_wanted_are_sent(motions: dict[str, StoredMotion]) -> None:
    _, line, _ = watching(motions["filmed"], wanted=("light", "audio"))
    assert {(d.track, d.index) for d in of(Data, line) if isinstance(d, Data)} == {(2, 0), (2, 1)}


async def test_the_silent_are_asked_once_and_then_gone(
    motions: dict[str, StoredMotion], monkeypatch: pytest.MonkeyPatch
) -> None:
    viewer, line, _ = watching(motions["one"])
    began = clock()
    now = [began]
    monkeypatch.setattr(viewers, "clock", lambda: now[0])
    for second in range(18):
        now[0] = began + second * 1_000_000
        viewer.advance()
    assert [opcode for opcode, _ in frames(line.sent)].count(9) == 1
    assert not line.aborted
    now[0] = began + 19_000_000
    viewer.advance()
    assert line.aborted


async def test_turns_come_when_blocks_are_due_and_not_for_all_at_once(
    motions: dict[str, StoredMotion], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = clock()
    monkeypatch.setattr(viewers, "clock", lambda: now)
    found = [watching(motions["one"], now=now) for _ in range(50)]
    turns = [viewer._next_turn() - now for viewer, _, _ in found]
    assert all(0 < turn <= 2_000_000 for turn in turns)
    assert len({turn // 100_000 for turn in turns}) > 5


async def test_a_failure_is_said_and_ends_it(
    motions: dict[str, StoredMotion], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    viewer, line, _ = watching(motions["one"])

    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(Viewer, "_next_turn", broken)
    viewer.advance()
    (problem,) = of(Problem, line)
    assert isinstance(problem, Problem)
    assert problem.title == "Our fault"
    assert "a viewer's turn failed" in caplog.text


def sent_of(line: Line) -> list[tuple[int, int, int]]:
    header = line.messages[0]
    assert isinstance(header, ChannelHeader)
    assert header.channels == 20
    return [(m.track, m.index, m.rate) for m in of(Data, line) if isinstance(m, Data)]


async def test_sound_goes_with_the_dance_at_its_lowest_until_the_line_has_shown_itself(
    motions: dict[str, StoredMotion],
) -> None:
    _, line, _ = watching(motions["sung"])
    assert sent_of(line)[:8] == [
        *((0, 0, 0), (1, 0, 0)),
        *((track, index, 1 - track) for index in range(1, 4) for track in (0, 1)),
    ]


async def test_a_pinned_rate_pins_the_dance_and_the_sound_goes_with_the_line(motions: dict[str, StoredMotion]) -> None:
    for pinned, sound, expected in ((1, 2, [(0, 1, 1), (1, 1, 0)]), (0, 0, [(0, 1, 0), (1, 1, 0)])):
        viewer, line, _ = watching(motions["sung"], pinned=pinned)
        assert sent_of(line)[2:4] == expected
        assert viewer._playing is not None
        choice = viewer._playing.rate
        for second in range(1, 9):
            choice.report(Report(buffer=4_000_000), clock() + second * 2_000_000)
        assert viewer._playing.step[:2] == (pinned, sound)


async def test_who_wants_no_sound_gets_none_and_who_wants_it_alone_gets_that(motions: dict[str, StoredMotion]) -> None:
    _, line, _ = watching(motions["sung"], wanted=("motion",))
    assert {track for track, _, _ in sent_of(line)} == {0}
    _, line, _ = watching(motions["sung"], wanted=("audio",))
    assert sent_of(line)[:4] == [(1, index, 0) for index in range(4)]


async def test_a_line_that_does_not_carry_both_gets_the_dance_alone(motions: dict[str, StoredMotion]) -> None:
    viewer, line, _ = watching(motions["sung"], private=True)
    assert viewer._playing is not None
    choice = viewer._playing
    for second in range(1, 6):
        choice.report(Report(buffer=0), clock() + second * 2_000_000)
    before = len(sent_of(line))
    viewer.hear(Edit(position=6_000_000).pack())
    viewer.advance()
    after = sent_of(line)[before:]
    assert after
    assert {(track, rate) for track, _, rate in after} == {(0, 0)}


async def test_who_comes_back_is_not_sent_again_what_it_holds(motions: dict[str, StoredMotion]) -> None:
    _, line, _ = watching(motions["one"], playing=False, held=Held("one", 0, (1, 1, -1, 0)))
    assert [type(message) for message in line.messages[:2]] == [ChannelHeader, TimelineState]
    data = [message for message in line.messages if isinstance(message, Data)]
    assert {(d.index, d.rate) for d in data if d.index < 4} == {(2, 1), (3, 1)}


async def test_held_blocks_of_another_motion_are_no_matter(motions: dict[str, StoredMotion]) -> None:
    _, line, _ = watching(motions["one"], playing=False, held=Held("two", 0, (1, 1)))
    assert [type(message) for message in line.messages[:3]] == [ChannelHeader, Description, TimelineState]
    assert [message.index for message in line.messages if isinstance(message, Data)][:2] == [0, 1]


async def test_a_viewer_is_told_once_what_was_chosen_and_why(motions: dict[str, StoredMotion]) -> None:
    viewer, line, _ = watching(motions["one"], playing=False, pinned=0)
    viewer.hear(Ping(1, 2).pack())
    viewer.advance()
    assert of(Choice, line) == [Choice(0, "pinned")]


async def test_a_viewer_is_told_when_the_reason_is_another(motions: dict[str, StoredMotion]) -> None:
    viewer, line, _ = watching(motions["one"], playing=False)
    for hidden in (True, True, False):
        viewer.hear(Report(buffer=3_000_000, hidden=hidden).pack())
        viewer.advance()
    assert [choice.reason for choice in of(Choice, line) if isinstance(choice, Choice)] == ["best", "hidden", "best"]


async def test_tracks_after_the_last_wanted_one_are_not_described(motions: dict[str, StoredMotion]) -> None:
    kinds = []
    for wanted in (("motion",), ("motion", "camera"), ("motion", "camera", "light")):
        _, line, _ = watching(motions["filmed"], playing=False, wanted=wanted)
        (described,) = of(Description, line)
        assert isinstance(described, Description)
        kinds.append([track["type"] for track in described.tracks])
    assert kinds == [["motion"], ["motion", "camera"], ["motion", "camera", "light"]]
