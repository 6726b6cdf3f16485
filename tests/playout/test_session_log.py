from __future__ import annotations

import msgpack
import pytest

from bunraku.motion.placement import Placement
from bunraku.playout import session_log
from bunraku.playout.session_log import (
    CHUNK_DURATION_US,
    LOG_DURATION_US,
    MAGIC,
    MAX_LOG_BYTES,
    CorruptSessionLog,
    SessionLog,
)
from bunraku.wire.limbs import MAX_LIMBS
from bunraku.wire.messages import Claim, TimelineState
from bunraku.wire.overlay import Overlay
from bunraku.wire.prop import Prop, PropState

MESSAGE_INTERVAL_US = 2 * Overlay.FRAME_INTERVAL_US


def make_overlay(number: int, limbs: int = 1) -> Overlay:
    frame = {limb: tuple(range(number % 1_000, number % 1_000 + 9)) for limb in range(limbs)}
    return Overlay(number & 0xFFFF, number * MESSAGE_INTERVAL_US, frame, (frame,))


def make_timeline(epoch: int, motion: str, clock: int) -> TimelineState:
    return TimelineState(epoch, motion, clock, 0, True, True, 10**6)


def add_overlays(log: SessionLog, numbers: range, limbs: int = 1) -> list[Overlay]:
    overlays = [make_overlay(number, limbs) for number in numbers]
    for overlay in overlays:
        log.add_message(overlay.due, overlay.pack())
    return overlays


def test_packed_log_holds_the_same_timelines_and_overlays() -> None:
    log = SessionLog()
    states = [make_timeline(epoch, motion, 5 * epoch) for epoch, motion in enumerate(("one", "two", "one"))]
    for state in states:
        log.add_timeline(state)
    overlays = add_overlays(log, range(1_000))
    reloaded = SessionLog.unpack(log.pack())
    assert list(reloaded.timelines) == states
    assert reloaded.motions == ("one", "two")
    assert list(reloaded.messages()) == overlays == list(log.messages())


@pytest.mark.parametrize("begin", [0, 1, 12_345_678, CHUNK_DURATION_US, 31_000_000, 1 << 50])
def test_part_holds_what_viewers_saw_since_its_begin(begin: int) -> None:
    log = SessionLog()
    states = [make_timeline(epoch, f"motion {epoch}", 4_000_000 * epoch) for epoch in range(8)]
    for state in states:
        log.add_timeline(state)
    overlays = add_overlays(log, range(1_000))
    part = SessionLog.unpack(log.pack(begin))
    kept = list(part.messages())
    assert kept == overlays[len(overlays) - len(kept) :]
    assert [overlay for overlay in overlays if overlay.due >= begin] == [o for o in kept if o.due >= begin]
    assert not kept or begin - kept[0].due <= CHUNK_DURATION_US
    # the first timeline is the one that applies at the begin
    assert list(part.timelines) == [state for state in states if state.clock + 4_000_000 > begin] or [states[-1]]
    assert list(log.messages(begin)) == kept


def test_hours_of_one_controlled_limb_keep_the_longest_recording() -> None:
    log = SessionLog()
    count = 3 * LOG_DURATION_US // MESSAGE_INTERVAL_US
    for number in range(count):
        log.add_message(number * MESSAGE_INTERVAL_US, b"a message")
    end = (count - 1) * MESSAGE_INTERVAL_US
    first = log._chunks[0]
    assert end - LOG_DURATION_US - 2 * CHUNK_DURATION_US < first.begin_us <= end - LOG_DURATION_US
    assert sum(len(chunk.messages) for chunk in log._chunks) == log._message_bytes < 1 << 19


def test_all_limbs_at_the_full_frame_rate_keep_the_longest_recording() -> None:
    bytes_per_message = len(make_overlay(0, MAX_LIMBS).pack()) + 2
    assert bytes_per_message * (LOG_DURATION_US + 2 * CHUNK_DURATION_US) / MESSAGE_INTERVAL_US < MAX_LOG_BYTES


def test_log_is_bounded_in_bytes_and_timelines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session_log, "MAX_LOG_BYTES", 30_000)
    log = SessionLog()
    overlays = add_overlays(log, range(3_000))
    kept = list(log.messages())
    assert 0 < len(kept) < len(overlays)
    assert kept == overlays[-len(kept) :]
    assert len(log.pack()) < 31_000
    for epoch in range(20_000):
        log.add_timeline(make_timeline(epoch, "one", 0))
    assert len(log.timelines) == session_log.MAX_TIMELINES


def test_timelines_that_no_recording_can_reach_are_dropped() -> None:
    log = SessionLog()
    for epoch in range(4):
        log.add_timeline(make_timeline(epoch, f"motion {epoch}", epoch * LOG_DURATION_US))
    # the second one applies until the third begins
    assert log.motions == ("motion 2", "motion 3")


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"something else",
        b"bunraku.log/2\x80",
        MAGIC + b"\xc1",
        MAGIC + msgpack.packb([1]),
        MAGIC + msgpack.packb({"timelines": []}),
        MAGIC + msgpack.packb({"timelines": [], "overlays": 7.5}),
        MAGIC + msgpack.packb({"timelines": [Claim(1).pack()], "overlays": b""}),
        MAGIC + msgpack.packb({"timelines": [b"\x04\xc1"], "overlays": b""}),
    ],
)
def test_invalid_bytes_raise_corrupt_session_log(data: bytes) -> None:
    with pytest.raises(CorruptSessionLog):
        SessionLog.unpack(data)


@pytest.mark.parametrize("overlays", [b"\x05", b"\x00\x00", b"\xff\xff\x05", b"\x02\x00\x05\x01", b"\x02\x00\x47\x81"])
def test_cut_or_foreign_messages_raise_corrupt_session_log(overlays: bytes) -> None:
    log = SessionLog.unpack(MAGIC + msgpack.packb({"timelines": [], "overlays": overlays}))
    with pytest.raises(CorruptSessionLog, match="at byte 0"):
        list(log.messages())


def test_props_are_those_of_the_last_change_before_a_time() -> None:
    log = SessionLog()
    held, laid = {0: Prop("fan", PropState(1))}, {0: Prop("fan", PropState(None, Placement(1.0, 2.0, 0.5)))}
    log.add_props(10, held)
    log.add_props(20, held)
    log.add_props(30, laid)
    for seen in (log, SessionLog.unpack(log.pack()), SessionLog.unpack(log.pack(29))):
        assert seen.props_at(29) == held
        assert seen.props_at(30) == seen.props_at(1 << 50) == laid
    assert log.props_at(9) == {}
    assert SessionLog.unpack(log.pack(31)).props_at(31) == laid
    log.add_props(40 + LOG_DURATION_US, {})
    assert log.props_at(20) == log.props_at(40) == laid


def test_log_without_props_is_that_of_earlier_releases() -> None:
    log = SessionLog()
    log.add_props(10, {})
    assert set(msgpack.unpackb(log.pack()[len(MAGIC) :])) == {"timelines", "overlays"}


@pytest.mark.parametrize("props", [1, [[1]], [[1, [[0, ["fan"]]]]], [["a", []]], [[5, []], [1, 2]]])
def test_log_with_damaged_props_is_rejected(props: object) -> None:
    data = MAGIC + msgpack.packb({"timelines": [], "overlays": b"", "props": props})
    with pytest.raises(CorruptSessionLog):
        SessionLog.unpack(data)
