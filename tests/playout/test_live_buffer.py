import numpy as np
import pytest

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.live import LiveEncoder, LiveTrack
from bunraku.codec.motion_track import plan_motion_track
from bunraku.motion import rotation
from bunraku.playout.live_buffer import LIVE_HOLD_US, MAX_FRAMES, LiveBuffer
from bunraku.wire.live import Live
from tests.codec.test_live import make_motion

BEGIN = 1_774_000_000_000_000
FRAME_US = Live.FRAME_INTERVAL_US
MOTION = make_motion(40)
SKELETON = plan_motion_track(MOTION).skeleton


def filled(numbers: list[int]) -> LiveBuffer:
    """Return a buffer of messages of two frames; message n holds the frames 2 n and 2 n + 1."""
    buffer, encoder = LiveBuffer(LiveTrack(SKELETON)), LiveEncoder(SKELETON)
    blocks = [
        encoder.encode(MOTION.root[2 * n : 2 * n + 2], MOTION.rotations[2 * n : 2 * n + 2]).data for n in range(20)
    ]
    for n in numbers:
        buffer.put(BEGIN + (2 * n + 1) * FRAME_US, 2, blocks[n])
    return buffer


def root_height(buffer: LiveBuffer, frame: float) -> float:
    pose = buffer.pose_at(BEGIN + frame * FRAME_US)
    assert pose is not None
    return float(pose[0][0])


def test_poses_are_those_of_the_frames_and_interpolated_between() -> None:
    buffer = filled(list(range(20)))
    for frame in range(40):
        assert root_height(buffer, frame) == pytest.approx(float(MOTION.root[frame, 0]), abs=0.004)
    between = root_height(buffer, 7.25)
    assert between == pytest.approx(0.75 * root_height(buffer, 7) + 0.25 * root_height(buffer, 8))


def test_order_and_repetition_of_messages_do_not_matter() -> None:
    in_order, shuffled = filled(list(range(20))), filled([3, 1, 0, 2, 3, 2, *range(19, 3, -1)])
    for frame in np.linspace(0, 39, 100):
        a, b = in_order.pose_at(BEGIN + frame * FRAME_US), shuffled.pose_at(BEGIN + frame * FRAME_US)
        assert a is not None
        assert b is not None
        np.testing.assert_array_equal(a[0], b[0])
        np.testing.assert_array_equal(a[1], b[1])


def test_skipped_messages_are_bridged() -> None:
    buffer = filled([0, 3, 6, 9])
    expected = rotation.slerp(
        buffer.pose_at(BEGIN + FRAME_US)[1],  # type: ignore[index]
        buffer.pose_at(BEGIN + 6 * FRAME_US)[1],  # type: ignore[index]
        np.full(18, 0.4),
    )
    np.testing.assert_allclose(buffer.pose_at(BEGIN + 3 * FRAME_US)[1], expected, atol=1e-9)  # type: ignore[index]


def test_pose_holds_for_a_while_and_then_ends() -> None:
    buffer = filled([0])
    last = BEGIN + FRAME_US
    assert buffer.pose_at(BEGIN - 1) is None
    assert buffer.pose_at(last + LIVE_HOLD_US) is not None
    assert buffer.pose_at(last + LIVE_HOLD_US + 1) is None
    # after a gap, the next pose takes effect when it is due
    late = filled([0, 19])
    np.testing.assert_array_equal(
        late.pose_at(last + LIVE_HOLD_US - 1)[0],  # type: ignore[index]
        late.pose_at(last)[0],  # type: ignore[index]
    )


def test_memory_is_bounded_and_damage_leaves_the_buffer_as_it_was() -> None:
    buffer, encoder = LiveBuffer(LiveTrack(SKELETON)), LiveEncoder(SKELETON)
    block = encoder.encode(MOTION.root[:1], MOTION.rotations[:1]).data
    for number in range(MAX_FRAMES + 50):
        buffer.put(BEGIN + number * FRAME_US, 1, block)
    assert len(buffer._due_times) == len(buffer._poses) == MAX_FRAMES
    before = list(buffer._due_times)
    with pytest.raises(DamagedBlock):
        buffer.put(BEGIN, 1, bytes([0xFF] * 40))
    assert buffer._due_times == before
