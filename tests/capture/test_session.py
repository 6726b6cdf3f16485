from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.session import CaptureSession, TimedPose
from bunraku.capture.vmc import VmcAssembler
from bunraku.motion import rotation
from bunraku.motion.skeleton import world_transforms
from tests.capture.network_faults import Arrival, Faults, simulate_arrivals
from tests.capture.samples import sample_performance
from tests.capture.vmc_performer import make_bundle, make_message, make_messages, perform_motion
from tests.motion.synthetic_motion import smooth_motion

FPS = 30.0


def datagram(number: int, seconds: float | None = None) -> bytes:
    performance = sample_performance()
    frame = number % performance.frame_count
    return make_bundle(make_messages(performance, frame, number / FPS if seconds is None else seconds))


def test_poses_begin_after_the_calibration() -> None:
    session = CaptureSession(VmcAssembler())
    poses: list[TimedPose] = []
    for number in range(60):
        poses += session.receive(datagram(number), 10.0 + number / FPS)
        assert (session.calibration is None) == (number < 30)
    assert len(poses) == 30
    assert poses[0].time_s == pytest.approx(11.0)
    assert poses[-1].pose.blendshapes == {"Joy": 0.5}
    assert session.statistics.released == 60


def test_poses_continue_during_a_new_calibration() -> None:
    session = CaptureSession(VmcAssembler())
    for number in range(40):
        session.receive(datagram(number), number / FPS)
    first = session.calibration
    session.recalibrate()
    for number in range(40, 69):
        assert len(session.receive(datagram(number), number / FPS)) == 1
        assert session.calibration is first
    for number in range(69, 75):
        assert len(session.receive(datagram(number), number / FPS)) == 1
    assert session.calibration is not first


def test_calibration_of_no_body_is_reported_and_begins_again() -> None:
    session = CaptureSession(VmcAssembler())
    hips = make_message("/VMC/Ext/Bone/Pos", "Hips", 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    for number in range(30):
        assert session.receive(make_bundle([hips, make_message("/VMC/Ext/T", number / FPS)]), number / FPS) == []
    last = make_bundle([hips, make_message("/VMC/Ext/T", 1.0)])
    with pytest.raises(UnreadableCapture, match="humanoid"):
        session.receive(last, 1.0)
    assert session.calibration is None
    for number in range(40, 80):
        session.receive(datagram(number), number / FPS)
    assert session.calibration is not None


def test_invalid_datagram_changes_nothing() -> None:
    session = CaptureSession(VmcAssembler())
    for number in range(40):
        session.receive(datagram(number), number / FPS)
        with pytest.raises(UnreadableCapture):
            session.receive(b"noise", number / FPS)
    assert session.calibration is not None
    assert session.statistics.released == 40


def resample_positions(session: CaptureSession, poses: list[TimedPose], ticks: np.ndarray) -> np.ndarray:
    """Return joint positions (n, 18, 3) at `ticks`, by the cubic through the neighbours' central differences."""
    assert session.calibration is not None
    root = np.array([timed.pose.root for timed in poses])
    rotations = np.array([timed.pose.rotations for timed in poses])
    placed, _ = world_transforms(session.calibration.figure, root, rotation.normalise(rotations))
    times = np.array([timed.time_s for timed in poses])
    slopes = np.gradient(placed, times, axis=0)
    index = np.clip(np.searchsorted(times, ticks) - 1, 0, len(times) - 2)
    width = (times[index + 1] - times[index])[:, None, None]
    u = ((ticks - times[index]) / (times[index + 1] - times[index]))[:, None, None]
    a, b = placed[index], placed[index + 1]
    sampled: np.ndarray = (
        (2 * u**3 - 3 * u**2 + 1) * a
        + (u**3 - 2 * u**2 + u) * width * slopes[index]
        + (3 * u**2 - 2 * u**3) * b
        + (u**3 - u**2) * width * slopes[index + 1]
    )
    return sampled


def acceleration_p99(arrivals: list[Arrival], packets: list[bytes], fps: float) -> float:
    """Return the p99 of the joints' accelerations, m/s^2, after a session with these arrivals."""
    session = CaptureSession(VmcAssembler())
    poses: list[TimedPose] = []
    for arrival in arrivals:
        while (deadline_s := session.deadline_s) is not None and deadline_s < arrival.arrival_s:
            poses += session.poll(deadline_s)
        poses += session.receive(packets[arrival.number], arrival.arrival_s)
    ticks = np.arange(2.5, len(packets) / fps - 0.5, 1.0 / fps)
    sampled = resample_positions(session, poses, ticks)
    acceleration = np.linalg.norm(np.diff(sampled, 2, axis=0), axis=-1) * fps**2
    return float(np.percentile(acceleration, 99))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_faulty_network_hardly_adds_acceleration(seed: int, tally: Callable[[str], None]) -> None:
    fps = 60.0
    performance = perform_motion(smooth_motion(frames=600, swing=0.5, fps=fps))
    faults = Faults()
    clean = Faults(loss=0.0, duplicates=0.0, jitter_s=0.0, reordering=0.0, drift=0.0)
    times = [number / fps * (1.0 + faults.drift) for number in range(performance.frame_count)]
    packets = [make_bundle(make_messages(performance, number, seconds)) for number, seconds in enumerate(times)]
    smooth = acceleration_p99(simulate_arrivals(len(packets), fps, clean, seed), packets, fps)
    faulty = acceleration_p99(simulate_arrivals(len(packets), fps, faults, seed), packets, fps)
    tally(f"joint acceleration p99, network with faults: {faulty / smooth:.3f}x that of a clean one")
    assert faulty <= 1.2 * smooth
