import itertools
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, standard_figure
from bunraku.playout.block_store import Pose
from bunraku.playout.performance import (
    FADE_US,
    HOLD_US,
    INITIAL_LATENESS_US,
    MAX_AGE_US,
    MAX_AHEAD_US,
    MAX_SAMPLES,
    Performance,
    SampleOutcome,
)

FRAME_US = 16_667
BEGIN = 1_774_000_000_000_000


def pose_of(time_us: int) -> Pose:
    """Pose of a smooth movement at a capture time."""
    t = (time_us - BEGIN) * 1e-6
    vectors = 0.4 * np.sin(2.0 * t + np.arange(JOINT_COUNT * 3)).reshape(JOINT_COUNT, 3)
    return np.array([0.3 * np.sin(t), 0.9, 0.2 * t]), rotation.from_rotation_vector(vectors)


def angle(a: Pose, b: Pose) -> float:
    """Return the largest angle between the joints of two poses, radians."""
    turn = rotation.multiply(rotation.conjugate(a[1]), b[1])
    return float(np.linalg.norm(rotation.to_rotation_vector(turn), axis=-1).max())


class Run:
    """A performer and a stage, frame by frame."""

    def __init__(self, fps: float = 60.0) -> None:
        self.performance = Performance(standard_figure(), fps)
        self.now = BEGIN
        self.shown: list[tuple[int, Pose]] = []

    def show(self) -> Pose:
        capture = self.now - self.performance.delay_us(self.now)
        pose = self.performance.pose_at(capture)
        self.shown.append((capture, pose))
        return pose

    def largest_step(self, since: int = 0) -> float:
        """Return the largest change of a joint from frame to frame from capture time `since` on, radians."""
        shown = [pose for capture, pose in self.shown if capture >= since]
        return max(angle(a, b) for a, b in itertools.pairwise(shown))


@given(seed=st.integers(0, 2**32), fps=st.sampled_from([24, 30, 60, 120, 240]))
@settings(max_examples=10, deadline=None)
def test_lost_late_doubled_and_reordered_samples_do_not_make_it_jump(seed: int, fps: int) -> None:
    dice, run = random.Random(seed), Run(fps)
    period = round(1e6 / fps)
    sent = [BEGIN + number * period for number in range(6 * fps) if dice.random() >= 0.05]
    sent += dice.sample(sent, len(sent) // 50)
    arrivals = sorted((sampled + dice.randrange(2_000, 30_000), sampled) for sampled in sent)
    for _ in range(6 * 60):
        run.now += FRAME_US
        while arrivals and arrivals[0][0] <= run.now:
            arrived, sampled = arrivals.pop(0)
            outcome = run.performance.add(sampled, pose_of(sampled), arrived)
            assert outcome in (SampleOutcome.APPLIED, SampleOutcome.DUPLICATE)
        run.show()
    # the movement itself turns joints by at most 1.4 rad/s, 0.024 rad per frame; the delay is learned in two seconds
    assert run.largest_step(since=BEGIN + 2_500_000) < 0.06
    settled = [(capture, pose) for capture, pose in run.shown if capture > BEGIN + 2_500_000]
    errors = [angle(pose, pose_of(capture)) for capture, pose in settled]
    # at 24 or 30 samples per second two losses in a row exceed the delay, and the pose stands still for a moment
    assert np.percentile(errors, 95 if fps > 30 else 80) < 0.02


def test_delay_follows_the_lateness_of_the_samples() -> None:
    for latency, expected in ((1_000, 22_000), (120_000, 141_000)):
        run = Run()
        assert run.performance.delay_us(BEGIN) == round(1e6 / 60 + INITIAL_LATENESS_US)
        for _ in range(60 * 40):
            run.now += FRAME_US
            run.performance.add(run.now - latency, pose_of(run.now - latency), run.now)
            run.show()
        assert run.performance.delay_us(run.now) == pytest.approx(expected, abs=2_000)
        capture, pose = run.shown[-1]
        assert angle(pose, pose_of(capture)) < 1e-3


def test_silent_performer_stands_still_then_rests_and_returns_smoothly() -> None:
    run = Run()

    def perform(frames: int, *, is_silent: bool = False) -> None:
        for _ in range(frames):
            run.now += FRAME_US
            if not is_silent:
                run.performance.add(run.now - 5_000, pose_of(run.now - 5_000), run.now)
            run.show()

    perform(120)
    last = run.now - 5_000
    perform(6, is_silent=True)
    held = run.shown[-1][1]
    assert angle(held, pose_of(last)) < 1e-6
    perform(20, is_silent=True)
    np.testing.assert_array_equal(run.shown[-1][1][1], held[1])
    assert not run.performance.is_at_rest(run.shown[-1][0])
    perform((HOLD_US + FADE_US) // FRAME_US, is_silent=True)
    assert run.performance.is_at_rest(run.shown[-1][0])
    root, rotations = run.shown[-1][1]
    np.testing.assert_allclose(np.abs(rotations[:, 0]), 1.0, atol=1e-9)
    np.testing.assert_allclose(root, [held[0][0], standard_figure().offsets[0, 1], held[0][2]], atol=1e-9)
    perform(60)
    assert angle(run.shown[-1][1], pose_of(run.shown[-1][0])) < 1e-3
    # rest to performance takes 0.3 s: minimum jerk is at most 1.9 times the mean speed
    assert run.largest_step() < 0.2


def test_samples_of_another_time_are_ignored() -> None:
    performance = Performance(standard_figure(), 60.0)
    pose = pose_of(BEGIN)
    assert performance.add(BEGIN - MAX_AGE_US - 1, pose, BEGIN) is SampleOutcome.LATE
    assert performance.add(BEGIN + MAX_AHEAD_US + 1, pose, BEGIN) is SampleOutcome.AHEAD
    assert performance.newest_us is None
    assert performance.add(BEGIN, pose, BEGIN) is SampleOutcome.APPLIED
    assert performance.add(BEGIN, pose, BEGIN) is SampleOutcome.DUPLICATE
    assert performance.newest_us == BEGIN


def test_memory_is_bounded_without_a_stage_that_shows_it() -> None:
    performance = Performance(standard_figure(), 60.0)
    for number in range(3 * MAX_SAMPLES):
        performance.add(BEGIN + number, pose_of(BEGIN), BEGIN)
    assert len(performance._times) == len(performance._samples) == MAX_SAMPLES
