from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from bunraku.codec import container
from bunraku.codec.container import StoredMotion
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.ingest.jobs.performers import (
    MAX_EXTRA_SPACING_M,
    PERFORMER_SPACING_M,
    combine_performers,
    place_side_by_side,
)
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion import rotation
from bunraku.motion.placement import Placement
from bunraku.motion.skeleton import Motion
from bunraku.wire.messages import Data
from tests.ingest.jobs.motions import MOTIONS
from tests.vectors.blocks import random_motion


def make_walk(name: str, metres: float, facing: float) -> StoredMotion:
    """Return a motion that moves `metres` to its left and back, around (3, -2), facing `facing` radians."""
    motion = random_motion(2.0, 30.0, 31)
    turn = rotation.from_coordinate_axis(1, np.full(60, facing))
    along = rotation.rotate(
        turn, np.stack([np.interp(range(60), (0, 30, 59), (0, metres, 0)), np.zeros(60), np.zeros(60)], 1)
    )
    rotations = motion.rotations.copy()
    rotations[:, 0] = turn
    walked = Motion(motion.figure, 30.0, along + np.array([3.0, 0.9, -2.0]), rotations)
    return container.unpack_motion(
        name, container.pack_motion(name, encode_motion(walked, error_bounds_mm=(30.0, 5.0), grade="live"))
    )


def stage_positions(motion: StoredMotion) -> list[np.ndarray]:
    """Return each performer's root positions on the stage, (frames, 3)."""
    positions = []
    for performer in motion.performers:
        packets = enumerate(performer.packets[-1])
        blocks = [
            decode_motion_block(performer.track, Data.unpack(packet).block).pose_at(
                np.arange(float(performer.track.frames_in(index)))
            )
            for index, packet in packets
        ]
        root, rotations = (np.concatenate(part) for part in zip(*blocks, strict=True))
        root, rotations = performer.placement.apply(root, rotations)
        forward = rotation.rotate(rotations[:, 0], np.array([0.0, 0.0, 1.0])).mean(axis=0)
        assert np.arctan2(forward[0], forward[2]) == pytest.approx(0.0, abs=0.05)
        positions.append(root)
    return positions


def test_row_is_as_close_as_the_movements_allow() -> None:
    still, wide = make_walk("still", 0.0, 2.0), make_walk("wide", 1.5, -1.0)
    result = combine_performers("three", still, [wide, still], None)
    assert isinstance(result, JobResult)
    assert result.description == {"tracks": ["motion"] * 3, "performers": 3, "made_from": "still"}
    roots = stage_positions(container.unpack_motion("three", result.packed))
    for left, right in pairwise(roots):
        assert (right[:, 0] - left[:, 0]).min() == pytest.approx(PERFORMER_SPACING_M, abs=0.15)
    middles = [(root[:, 0].min() + root[:, 0].max()) / 2 for root in roots]
    assert middles[0] + middles[2] == pytest.approx(0.0, abs=0.1)
    for root in roots:
        assert abs(root[:, 2]).max() < 0.1


def test_equal_motions_get_the_minimum_spacing() -> None:
    wide = make_walk("wide", 3.0, 1.0)
    result = combine_performers("two", wide, [wide], None)
    assert isinstance(result, JobResult)
    left, right = stage_positions(container.unpack_motion("two", result.packed))
    assert right[:, 0] - left[:, 0] == pytest.approx(PERFORMER_SPACING_M, abs=1e-6)


def test_extra_spacing_is_limited() -> None:
    wide, still = make_walk("far", 30.0, 0.0), make_walk("still", 0.0, 0.0)
    left, right = place_side_by_side([wide.performers[0], still.performers[0]])
    middles = [placement.x + 3.0 + half for placement, half in ((left, 15.0), (right, 0.0))]
    assert middles[1] - middles[0] == pytest.approx(PERFORMER_SPACING_M + MAX_EXTRA_SPACING_M, abs=0.6)


def test_given_placements_must_match_the_performers() -> None:
    placements = [Placement(0.0, 1.0, 0.0), Placement(0.5, -1.0, 3.0)]
    result = combine_performers("m", MOTIONS["one"], [MOTIONS["two"]], placements)
    assert isinstance(result, JobResult)
    assert [performer.placement for performer in container.unpack_motion("m", result.packed).performers] == placements
    rejected = combine_performers("m", MOTIONS["one"], [MOTIONS["both"]], placements)
    assert isinstance(rejected, JobRejection)
    assert rejected.field == "places"


def test_more_than_four_performers_are_rejected() -> None:
    rejected = combine_performers("m", MOTIONS["both"], [MOTIONS["both"], MOTIONS["one"]], None)
    assert isinstance(rejected, JobRejection)
    assert (rejected.title, rejected.field) == ("Too many performers", "motions")
    assert "this would have 5" in rejected.detail


def test_progress_is_reported_per_performer() -> None:
    reports: list[float] = []
    combine_performers("m", MOTIONS["one"], [MOTIONS["two"]], None, reports.append)
    assert reports == [0.5, 1.0]
