from __future__ import annotations

import numpy as np
import pytest

from bunraku.demo import staging
from bunraku.demo.choreography import SCORE, animate_dance
from bunraku.ingest.keyframe import Staging, check_keyframe_order
from bunraku.motion import skeleton


def test_camera_loops_and_moves_smoothly() -> None:
    keyframes = staging.camera_keyframes(SCORE)
    assert len(keyframes) == round(SCORE.duration * staging.KEYFRAME_RATE_FPS)
    places = np.array([key["position"] for key in keyframes])
    steps = np.diff(places, axis=0, append=places[:1])
    assert np.linalg.norm(steps, axis=1).max() * staging.KEYFRAME_RATE_FPS < 4.0
    assert np.linalg.norm(steps[-1]) < 0.01


def test_performer_stays_in_the_picture() -> None:
    motion = animate_dance(30.0)
    places = skeleton.joint_and_tip_positions(motion.figure, motion.root, motion.rotations)
    for frame, (place, gaze, field) in enumerate(_camera_views()):
        ahead = (gaze - place) / np.linalg.norm(gaze - place)
        right = np.cross(ahead, (0.0, 1.0, 0.0))
        right /= np.linalg.norm(right)
        above = np.cross(right, ahead)
        seen = places[frame] - place
        depth = seen @ ahead
        half = np.tan(field / 2)
        height, aside = seen @ above / depth / half, seen @ right / depth / half
        # below are a page's controls; a window of 4:5 is the narrowest that it is shown whole in
        assert -0.72 < height.min() <= height.max() < 0.9, f"cut off at {frame / 30:.1f} s"
        assert np.abs(aside).max() < 4 / 5, f"cut off at {frame / 30:.1f} s"


def test_three_lights_loop_and_none_goes_out() -> None:
    tracks = staging.light_keyframes(SCORE)
    assert len(tracks) == 3
    for keyframes in tracks:
        intensity = [key["intensity"] for key in keyframes]
        assert min(intensity) > 0.3
        assert max(intensity) == pytest.approx(1.0)
        assert intensity[0] == pytest.approx(intensity[-1], abs=0.02)


def test_staging_is_accepted_by_the_service() -> None:
    asked = Staging.model_validate(
        {"camera": staging.camera_keyframes(SCORE), "lights": staging.light_keyframes(SCORE)}
    )
    check_keyframe_order(asked)


def _camera_views() -> list[tuple[np.ndarray, np.ndarray, float]]:
    return [(np.array(k["position"]), np.array(k["gaze"]), float(k["fov"])) for k in staging.camera_keyframes(SCORE)]
