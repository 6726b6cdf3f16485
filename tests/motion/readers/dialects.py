"""Tables of dialects: files of one dance as programs write them, with what is read, or the error.

Every file that is read is analysed, and its joints are compared with those of the plain dance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from bunraku.motion.analysis import Analysis, analyse
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.readers.motion_file import read_motion
from bunraku.motion.skeleton import JOINT_INDEX, JOINTS, world_transforms
from tests.motion.synthetic_motion import export_bvh, smooth_motion

FRAMES, FPS = 20, 30.0
PLAIN_BVH = export_bvh(smooth_motion(frames=FRAMES, fps=FPS))
"""The plain dance, in centimetres."""


@dataclass(frozen=True, slots=True)
class Reads:
    """A file that is read as the dance of `frames` frames.

    `size` is that of the body compared with the plain one. `apart_mm` is the largest distance of its joints from those
    of the dance, None if the file has another motion. Each of `notes` is part of a sentence for the uploader.
    """

    name: str
    data: bytes | Callable[[], bytes]
    frames: int = FRAMES
    fps: float = FPS
    unit: str | None = None
    size: float = 1.0
    mirrored: bool = False
    apart_mm: float | None = 1.0
    notes: tuple[str, ...] = ()
    take: str | None = None

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class Refused:
    """A file that is refused with `title`, the `line` or `field` of the place, and words of detail or hint."""

    name: str
    data: bytes | Callable[[], bytes]
    title: str
    line: int | None = None
    field: str | None = None
    words: str = ""
    take: str | None = None

    def __str__(self) -> str:
        return self.name


@cache
def plain_source() -> Bvh:
    """Return the plain dance as it is read."""
    return parse_bvh(PLAIN_BVH)


@cache
def plain_analysis() -> Analysis:
    """Return the analysis of the plain dance."""
    return analyse(plain_source())


def check(case: Reads | Refused) -> None:
    """Assert that a file is read, or refused, as its table says."""
    data = case.data if isinstance(case.data, bytes) else case.data()
    if isinstance(case, Refused):
        with pytest.raises(UnreadableFile) as caught:
            analyse(read_motion(data, case.take))
        error = caught.value
        assert (error.title, error.line, error.field) == (case.title, case.line, case.field), str(error)
        assert error.hint, str(error)
        assert case.words in f"{error.detail} {error.hint}", str(error)
        return
    analysis = analyse(read_motion(data, case.take))
    motion = analysis.motion
    assert (motion.frame_count, round(motion.fps, 6)) == (case.frames, case.fps)
    assert case.unit is None or analysis.unit == case.unit
    sentences = " ".join(analysis.assumptions)
    for note in case.notes:
        assert note in sentences
    plain = plain_analysis()
    thighs = [each.motion.figure.offsets[JOINT_INDEX["l_knee"]] for each in (analysis, plain)]
    assert np.linalg.norm(thighs[0]) == pytest.approx(case.size * np.linalg.norm(thighs[1]), rel=0.01)
    if case.apart_mm is None:
        return
    assert analysis.source_joints.keys() == plain.source_joints.keys()
    # every so many frames are at the times of the plain ones
    step = max(round(case.fps / FPS), 1)
    placed = world_transforms(motion.figure, motion.root, motion.rotations)[0][::step]
    expected, _ = world_transforms(plain.motion.figure, plain.motion.root, plain.motion.rotations)
    expected = case.size * expected[: len(placed)]
    if case.mirrored:
        other = [JOINT_INDEX[{"l_": "r_", "r_": "l_"}.get(name[:2], name[:2]) + name[2:]] for name in JOINTS]
        expected = expected[:, other] * [-1.0, 1.0, 1.0]
    apart = np.linalg.norm(placed - expected, axis=-1)
    assert 1000.0 * apart.max() < case.apart_mm * case.size
