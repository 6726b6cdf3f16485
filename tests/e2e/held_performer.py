"""Checks of a performer whose hands and left leg are held: as shown to a viewer, and as a motion of the library."""

from __future__ import annotations

import asyncio
import copy
import math
from collections.abc import Sequence
from pathlib import Path

import httpx2
import numpy as np

from bunraku.client import Client, Viewer
from bunraku.marionette.limb_rig import ArmRig, LegRig, Limb
from bunraku.marionette.solver.vector import Vector
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINTS, TIP_JOINTS, Figure
from bunraku.playout.block_store import Pose
from bunraku.wire.live import Live
from tests.bench.live import compare_motions
from tests.bench.live_stage import Source, match_poses, place_points
from tests.e2e.test_capture_stream import MAX_ERROR_MM
from tests.e2e.test_live import wait_for_motion
from tests.e2e.test_performers import load_blocks
from tests.time_limit import HANG_TIMEOUT_S

HELD_LIMBS = Limb.LEFT_HAND, Limb.RIGHT_HAND, Limb.LEFT_LEG
MAX_ACCELERATION_RATIO = 1.2
"""Bound of p99 of the accelerations against those without losses, that of `make bench-live`."""
MAX_LAG_US = 900_000
MAX_TARGET_ERROR = 0.06
"""Bound of the median distance from the target, arm lengths or radians."""
MAX_ARCHIVE_ERROR_MM = 5.0
HELD_JOINTS = {"l_elbow", "l_wrist", "r_elbow", "r_wrist", "l_knee", "l_ankle", "l_midtarsal"}
FREE_POINTS = [n for n, name in enumerate([*JOINTS, *(JOINTS[k] for k in TIP_JOINTS)]) if name not in HELD_JOINTS]


def target_at(limb: Limb, time_s: float) -> Vector:
    """Return where a friend moves a limb."""
    swing = math.sin(2.0 * time_s)
    if not limb.is_hand:
        return (0.5 + 0.3 * swing, 0.0, 0.0)
    return (0.5 if limb is Limb.LEFT_HAND else -0.5, 0.3 + 0.25 * swing, 0.5)


class FrameRecorder:
    """Merged poses of both performers at even times, whenever the viewer is drawn."""

    def __init__(self, viewer: Viewer) -> None:
        self.frames: dict[int, list[Pose]] = {}
        self._viewer = viewer
        self._next = 0

    def record(self, reference: int, _: Pose) -> None:
        self._next = self._next or reference
        for due in range(self._next, reference + 1, Live.FRAME_INTERVAL_US):
            poses = [self._viewer.pose_at(due, performer) for performer in (0, 1)]
            self.frames[due] = [pose for pose in poses if pose is not None]
            self._next = due + Live.FRAME_INTERVAL_US

    async def record_next(self, count: int) -> list[list[Pose]]:
        """Return the next frames of each performer."""
        self.frames.clear()
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while len(self.frames) < count:  # noqa: ASYNC110
                await asyncio.sleep(0.05)
        assert {len(poses) for poses in self.frames.values()} == {2}, "a pose is missing"
        return [[poses[performer] for poses in self.frames.values()] for performer in (0, 1)]


def check_held_limbs(figure: Figure, poses: Sequence[Pose], times_us: Array) -> None:
    """Assert that each limb follows its target, with a delay that is the same for all frames."""
    rotations = [pose.tolist() for _, pose in poses]
    lags_us = np.arange(0, MAX_LAG_US, 10_000)
    for limb in HELD_LIMBS:
        if limb.is_hand:
            arm = ArmRig(figure, limb)
            found = np.array([arm.tip_target(arm.pose_joints(pose)) for pose in rotations])
        else:
            leg = LegRig(figure, limb)
            found = np.array([(leg.thigh_angle(pose), 0.0, 0.0) for pose in rotations])
        targets = np.array([[target_at(limb, 1e-6 * (at - lag)) for lag in lags_us] for at in times_us])
        errors = np.median(np.linalg.norm(targets - found[:, None], axis=-1), axis=0)
        assert errors.min() < MAX_TARGET_ERROR, f"{limb.name} is off the target by {errors.min():.3f}"


def check_free_limbs(source: Source, begin_us: int, figure: Figure, poses: list[Pose], times_us: Array) -> None:
    """Assert that the other limbs have the poses that were captured."""
    free = copy.copy(source)
    free.points = source.points[:, FREE_POINTS]
    match = match_poses(free, begin_us, times_us, place_points(figure, poses)[:, FREE_POINTS])
    assert np.median(match.errors_mm) < MAX_ERROR_MM


def check_smoothness(lossy: Array, clean: Array) -> None:
    """Assert that p99 of the accelerations is hardly above that without losses: of all points, and of free ones."""
    for points in (slice(None), FREE_POINTS):
        ratio = p99_acceleration(lossy[:, points]) / p99_acceleration(clean[:, points])
        assert ratio <= MAX_ACCELERATION_RATIO, f"losses make points jump: acceleration {ratio:.2f}x"


def p99_acceleration(points: Array) -> float:
    """Return p99 of the accelerations of positions (n, k, 3), metres per squared frame."""
    return float(np.percentile(np.linalg.norm(np.diff(points, 2, axis=0), axis=-1), 99))


async def check_archive(client: Client, url: str, motion: str, take: Path, min_frames: int) -> None:
    """Assert that the motion in the library is the take of the capture, to its end."""
    assert (await wait_for_motion(client, motion))["name"] == "Aiko"
    uploaded = await load_points(url, (await client.upload(take))["id"])
    archived = await load_points(url, motion)
    assert len(archived) >= min_frames
    assert compare_motions(uploaded, archived) < MAX_ARCHIVE_ERROR_MM
    last_second = np.linalg.norm(uploaded[-60:] - archived[-60:], axis=-1)
    assert 1e3 * last_second.mean() < MAX_ERROR_MM


async def load_points(url: str, motion: str) -> Array:
    """Return the positions (n, 23, 3) of a stored motion at 60 Hz."""
    async with httpx2.AsyncClient(base_url=url) as http:
        store, _ = await load_blocks(http, motion)
    poses = [store.pose_at(round(k * 1e6 / 60)) for k in range(store.track.frames)]
    return place_points(store.track.figure, [pose for pose in poses if pose is not None])
