from __future__ import annotations

import pytest

from bunraku.backing.frames import message
from bunraku.backing.library import StoredMotion, pack, unpack
from bunraku.codec.encode import encode_motion
from bunraku.playout import timeline
from bunraku.playout.held import Held
from bunraku.stream.flow import Flow
from bunraku.stream.playing import Playing
from bunraku.stream.tracks import TRACKS
from bunraku.wire.messages import Choice, Data, Report
from bunraku.wire.messages import unpack as unpack_message
from tests.vectors.blocks import wandering_motion

FREE = Flow(None, lambda: 0)


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    encoded = encode_motion(wandering_motion(9.2, 30.0, 9), ladder=(30.0, 5.0), grade="live")
    return unpack("m", pack("m", encoded))


def all_packets(playing: Playing, motion: StoredMotion) -> list[tuple[int, int]]:
    """Index and rate of each block that is sent to one who stands at the beginning."""
    state = timeline.start("m", motion.track.duration_us, 0, playing=False)
    found: list[tuple[int, int]] = []
    while (packet := playing.next_packet(state, 0, FREE, 0)) is not None:
        data = Data.unpack(packet)
        found.append((data.index, data.rate))
    return found


def test_what_is_within_reach_is_sent_once(motion: StoredMotion) -> None:
    playing = Playing(motion, TRACKS, None)
    found = all_packets(playing, motion)
    assert found[0] == (0, 0)
    assert [index for index, _ in found[1:]] == list(range(1, len(found)))
    assert {rate for _, rate in found[1:]} == {1}
    assert all_packets(playing, motion) == []


def test_what_is_held_of_this_motion_is_not_sent_again(motion: StoredMotion) -> None:
    playing = Playing(motion, TRACKS, None)
    assert not playing.has(None)
    assert not playing.has(Held("another", 0, (1, 1, 1)))
    blocks = motion.track.blocks
    # told from the last block on, around the end
    assert playing.has(Held("m", blocks - 1, (1, 1, -1, 1)))
    assert [index for index, _ in all_packets(playing, motion)][:2] == [1, 3]


def test_a_choice_is_news_once_and_again_when_rate_or_reason_change(motion: StoredMotion) -> None:
    playing = Playing(motion, TRACKS, None)

    def news() -> Choice | None:
        framed = playing.news()
        told = None if framed is None else unpack_message(message(framed))
        assert told is None or isinstance(told, Choice)
        return told

    hidden = Report(buffer=3_000_000, hidden=True)
    unsaid = [playing.unsaid]
    assert news() == Choice(1, "best")
    assert news() is None
    unsaid.append(playing.unsaid)
    assert playing.report(hidden, 1_000_000)
    unsaid.append(playing.unsaid)
    assert news() == Choice(0, "hidden")
    assert not playing.report(hidden, 2_000_000)
    unsaid.append(playing.unsaid)
    assert unsaid == [True, False, True, False]


def test_a_rate_that_was_asked_for_is_kept_and_said_so(motion: StoredMotion) -> None:
    playing = Playing(motion, TRACKS, 0)
    framed = playing.news()
    assert framed is not None
    assert unpack_message(message(framed)) == Choice(0, "pinned")
    assert {rate for _, rate in all_packets(playing, motion)} == {0}


def test_who_wants_no_motion_is_told_of_no_choice(motion: StoredMotion) -> None:
    assert Playing(motion, ("audio",), None).news() is None
