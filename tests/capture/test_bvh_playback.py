from __future__ import annotations

import numpy as np
import pytest

from bunraku.capture.bvh_playback import MAX_LAG_S, BvhPlayback
from bunraku.capture.errors import UnreadableCapture
from bunraku.motion.analysis import analyse
from bunraku.motion.bvh import parse_bvh
from tests.motion.synthetic_motion import export_bvh, smooth_motion

DATA = export_bvh(smooth_motion(frames=30))


def test_frames_are_due_at_the_frame_rate() -> None:
    motion = analyse(parse_bvh(DATA)).motion
    playback = BvhPlayback(DATA, 100.0)
    number = 0
    while (deadline_s := playback.deadline_s) is not None:
        assert playback.poll(deadline_s - 1e-3) == []
        (timed,) = playback.poll(deadline_s)
        assert timed.time_s == deadline_s == pytest.approx(100.0 + number / 30.0)
        np.testing.assert_array_equal(timed.pose.root, motion.root[number])
        np.testing.assert_array_equal(timed.pose.rotations, motion.rotations[number])
        number += 1
    assert number == 30
    assert playback.poll(1e6) == []


def test_loop_continues_with_increasing_times() -> None:
    playback = BvhPlayback(DATA, 0.0, loop=True)
    poses = [timed for step in range(200) for timed in playback.poll(step / 50.0)]
    times = [timed.time_s for timed in poses]
    np.testing.assert_allclose(np.diff(times), 1.0 / 30.0)
    np.testing.assert_array_equal(poses[31].pose.root, poses[1].pose.root)


def test_late_caller_skips_frames() -> None:
    playback = BvhPlayback(DATA, 0.0, loop=True)
    assert playback.poll(-5.0) == []
    poses = playback.poll(1e6)
    assert 0 < len(poses) <= 30 * MAX_LAG_S + 2
    assert BvhPlayback(DATA, 0.0).poll(1e6) == []


def test_other_files_are_rejected() -> None:
    with pytest.raises(UnreadableCapture, match="line 1"):
        BvhPlayback(b"not a motion", 0.0)
