from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.track import (
    FIGURE_UNIT,
    describe_track,
    pack_figure,
    pack_reference,
    plan,
    read_track,
    unpack_figure,
    unpack_reference,
)
from bunraku.motion.skeleton import INDEX, Motion, standard_figure
from tests.vectors.blocks import wandering_motion


def test_figure_and_reference_survive_their_bytes() -> None:
    track, motion = plan(wandering_motion(1.0, 30.0, 1))
    figure = unpack_figure(pack_figure(track.figure))
    np.testing.assert_allclose(figure.offsets, motion.figure.offsets, atol=1e-12)
    np.testing.assert_allclose(figure.tips, motion.figure.tips, atol=1e-12)
    np.testing.assert_array_equal(unpack_reference(pack_reference(track.reference)), track.reference)
    assert len(pack_figure(figure)) == 138
    assert len(pack_reference(track.reference)) == 51


def test_the_figure_moves_by_half_a_grid_step_at_most() -> None:
    track, _ = plan(wandering_motion(1.0, 30.0, 1))
    assert abs(track.figure.offsets - standard_figure().offsets).max() <= FIGURE_UNIT / 2 + 1e-12


def test_wrong_lengths_are_refused() -> None:
    with pytest.raises(DamagedBlock, match="138"):
        unpack_figure(bytes(137))
    with pytest.raises(DamagedBlock, match="51"):
        unpack_reference(bytes(52))


@pytest.mark.parametrize("fps", [23.976, 30.0, 40.0, 59.94, 120.0])
def test_blocks_tile_the_motion(fps: float) -> None:
    motion = wandering_motion(3.3, fps, 2)
    track, _ = plan(motion)
    assert sum(track.frames_in(i) for i in range(track.blocks)) == motion.frames
    for i in range(track.blocks):
        assert track.block_at(track.start_us(i)) == i
        assert i == 0 or track.block_at(track.start_us(i) - 1000) == i - 1
    assert track.block_at(-5) == 0
    assert track.block_at(track.duration_us + 5) == track.blocks - 1


def test_levers_fall_along_a_limb() -> None:
    levers = plan(wandering_motion(1.0, 30.0, 1))[0].levers
    assert levers[0] == 2.6
    chain = [levers[1 + INDEX[name]] for name in ("l_hip", "l_knee", "l_ankle", "l_midtarsal")]
    assert chain == sorted(chain, reverse=True)


def test_very_high_frame_rates_keep_blocks_within_the_format() -> None:
    still = wandering_motion(0.01, 240.0, 1)
    track, _ = plan(Motion(still.figure, 5000.0, still.root, still.rotations))
    assert track.block_frames == 1000


def test_a_track_survives_its_description() -> None:
    track, _ = plan(wandering_motion(1.0, 29.97, 1))
    again = read_track(describe_track(track, []))
    assert (again.fps, again.frames, again.block_frames) == (track.fps, track.frames, track.block_frames)
    np.testing.assert_allclose(again.levers, track.levers, atol=1e-12)


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("codec", "other/2", "other/2"),
        ("fps", "fast", "numbers"),
        ("fps", 0, "above zero"),
        ("block_frames", 5000, "1..1000"),
        ("figure", "no", "figure"),
        ("reference", b"", "51"),
    ],
)
def test_a_wrong_description_is_refused(key: str, value: object, says: str) -> None:
    described = describe_track(plan(wandering_motion(1.0, 30.0, 1))[0], [])
    described[key] = value
    with pytest.raises(DamagedBlock, match=says):
        read_track(described)
