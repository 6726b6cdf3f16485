"""Source motion of a tree of nodes with keyframes, as glTF and FBX have it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from bunraku.motion import rotation
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.joint_tree import ancestor_chain
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import NTSC_RATES, EndSite

MAX_FRAMES, MAX_JOINT_FRAMES = 1_000_000, 8_000_000
"""Bounds of the frames that sparse keys are sampled at, and of frames times joints."""
MAX_SHAPES = 2_000
"""Blend shapes that are read; faces of production have a few hundred."""
MIN_FPS, MAX_FPS, DEFAULT_FPS = 24.0, 240.0, 60.0
"""Keys that are less dense than `MIN_FPS` are sampled at `DEFAULT_FPS`."""
MIN_SCALE = 1e-9
"""Smaller scales count as this one, so that descendants keep their orientation."""
EVEN_TOLERANCE = 0.02
"""Frame rates this near to a whole number, as a share, are that number."""


STEP_TOLERANCE_S = 1e-4
"""Steps this little after a frame belong to it: times of keys are rounded."""
NTSC_TOLERANCE = 2.5e-4
"""Frame rates this near to one of NTSC, as a share, are that one: a quarter of its distance from a whole number."""


class Interpolation(StrEnum):
    """Interpolation between keys; the values are those of glTF."""

    STEP = "STEP"
    LINEAR = "LINEAR"
    CUBIC = "CUBICSPLINE"


@dataclass(frozen=True, slots=True)
class Track:
    """Keys of one property: `times` (k,) in seconds, ascending, and `values` (k, m).

    Cubic keys have `values` (k, 3, m): incoming tangent, value, outgoing tangent, per second.
    """

    times: Array
    values: Array
    interpolation: Interpolation = Interpolation.LINEAR

    def sample(self, times: Array) -> Array:
        """Return the values (n, m) at `times` (n,); before the first and after the last key, those of that key."""
        if len(self.times) == 1 or self.interpolation is Interpolation.STEP:
            after = np.searchsorted(self.times, times + STEP_TOLERANCE_S, side="right") - 1
            held: Array = self._knots()[np.clip(after, 0, len(self.times) - 1)]
            return held
        index = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)
        gap = self.times[index + 1] - self.times[index]
        share = np.clip((times - self.times[index]) / np.where(gap > 0.0, gap, 1.0), 0.0, 1.0)
        if self.interpolation is Interpolation.CUBIC:
            return self._sample_cubic(index, gap, share)
        knots = self.values
        start, end = knots[index], knots[index + 1]
        if knots.shape[1] == 4:
            return rotation.normalise(rotation.slerp(start, end, share))
        return start + (end - start) * share[:, None]

    def _knots(self) -> Array:
        knots: Array = self.values[:, 1] if self.interpolation is Interpolation.CUBIC else self.values
        return knots

    def _sample_cubic(self, index: npt.NDArray[np.int64], gap: Array, share: Array) -> Array:
        """Return the cubic Hermite spline (glTF 2.0, appendix C)."""
        s, g = share[:, None], gap[:, None]
        start, end = self.values[index], self.values[index + 1]
        value = (
            (2.0 * s**3 - 3.0 * s**2 + 1.0) * start[:, 1]
            + g * (s**3 - 2.0 * s**2 + s) * start[:, 2]
            + (3.0 * s**2 - 2.0 * s**3) * end[:, 1]
            + g * (s**3 - s**2) * end[:, 0]
        )
        return rotation.normalise(value) if value.shape[1] == 4 else value


@dataclass(slots=True)
class Node:
    """Node of the tree: its transform relative to its parent at rest, and the tracks that replace parts of it.

    Rotations are w x y z.
    """

    name: str
    parent: int
    translation: Array
    rotation: Array
    scale: Array
    tracks: dict[str, Track] = field(default_factory=dict)
    """By the name of the attribute: translation, rotation, scale."""

    def rest_transform(self) -> tuple[tuple[str, Array], ...]:
        """Return translation (3,), rotation (4,) and scale (3,) with their names."""
        return ("translation", self.translation), ("rotation", self.rotation), ("scale", self.scale)


@dataclass(frozen=True, slots=True)
class NodeMotion:
    """Source motion of nodes, parents before their children, sampled at `fps` from `start`, in seconds.

    Scales act on the positions of descendants; a node's orientation is that of its axes, without scale.
    """

    nodes: tuple[Node, ...]
    start: float
    fps: float
    frame_count: int
    notes: tuple[str, ...] = ()
    metres_per_unit: float | None = None
    expressions: dict[str, Array] = field(default_factory=dict)

    @property
    def times(self) -> Array:
        """Times (n,) of the frames, in seconds."""
        return self.start + np.arange(self.frame_count) / self.fps

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the nodes."""
        return tuple(node.name for node in self.nodes)

    @property
    def parents(self) -> tuple[int, ...]:
        """Parent of each node, -1 for the root."""
        return tuple(node.parent for node in self.nodes)

    @property
    def ends(self) -> tuple[EndSite, ...]:
        """Ends of bones beyond the nodes: none."""
        return ()

    @property
    def joint_lines(self) -> tuple[int | None, ...]:
        """Lines of the nodes: none."""
        return (None,) * len(self.nodes)

    @property
    def rest_positions(self) -> Array:
        """World positions (J, 3) of the nodes without tracks, the root at the origin."""
        positions: Array = self._compose(range(len(self.nodes)), None)[0][0]
        from_root: Array = positions - positions[0]
        return from_root

    @property
    def rest_orientations(self) -> Array:
        """World orientations (J, 4) of the nodes without tracks."""
        orientations: Array = self._compose(range(len(self.nodes)), None)[1][0]
        return orientations

    def world_transforms(self, joints: list[int], frames: npt.NDArray[np.int64] | None = None) -> tuple[Array, Array]:
        """Return positions (n, J, 3) and orientations (n, J, 4) of `joints` and their ancestors in the world."""
        chosen = np.arange(self.frame_count) if frames is None else frames
        parents = self.parents
        used = sorted({above for joint in joints for above in ancestor_chain(parents, joint)})
        return self._compose(used, self.start + chosen / self.fps)

    def _compose(self, joints: Sequence[int], times: Array | None) -> tuple[Array, Array]:
        """Return world transforms at `times` (n,), or at rest (n = 1), of `joints`, which contain their ancestors."""
        count = 1 if times is None else len(times)
        positions = np.zeros((count, len(self.nodes), 3))
        orientations = np.zeros((count, len(self.nodes), 4))
        axes: dict[int, Array] = {}
        for joint in joints:
            node = self.nodes[joint]
            translation, turn, scale = (
                node.tracks[name].sample(times)
                if times is not None and name in node.tracks
                else np.broadcast_to(at_rest, (count, len(at_rest)))
                for name, at_rest in node.rest_transform()
            )
            local = rotation.to_matrix(turn) * np.where(np.abs(scale) < MIN_SCALE, MIN_SCALE, scale)[:, None, :]
            if node.parent < 0:
                positions[:, joint], axes[joint] = translation, local
            else:
                above = axes[node.parent]
                positions[:, joint] = positions[:, node.parent] + (above @ translation[:, :, None])[:, :, 0]
                axes[joint] = above @ local
            orientations[:, joint] = _orientation(axes[joint])
        return positions, orientations


def _orientation(axes: Array) -> Array:
    """Return the orientations (n, 4) of `axes` (n, 3, 3), whose columns may be of any length and not orthogonal."""
    x = rotation.normalise(axes[..., 0])
    y = axes[..., 1]
    y = rotation.normalise(y - x * np.sum(x * y, axis=-1, keepdims=True))
    return rotation.from_matrix(np.stack([x, y, np.cross(x, y)], axis=-1))


def choose_rate(key_times: Sequence[Array]) -> float:
    """Return the frame rate of the densest track with `key_times`; a whole number or an NTSC rate if it nearly is."""
    steps = [float(np.median(np.diff(times))) for times in key_times if len(times) > 2]
    steps = [step for step in steps if step > 0.0]
    rate = 1.0 / min(steps) if steps else DEFAULT_FPS
    for usual in NTSC_RATES:
        if abs(rate - usual) < NTSC_TOLERANCE * usual:
            return usual
    if rate < MIN_FPS:
        return DEFAULT_FPS
    if abs(rate - round(rate)) < EVEN_TOLERANCE * rate and round(rate) > 0:
        rate = float(round(rate))
    return min(rate, MAX_FPS)


def sample_nodes(
    nodes: Sequence[Node],
    start: float,
    end: float,
    fps: float,
    notes: Sequence[str],
    metres_per_unit: float | None = None,
) -> NodeMotion:
    """Return the motion of `nodes` from `start` to `end`, in seconds; raise `UnreadableFile` if it is too much."""
    duration = end - start
    if not np.isfinite(duration) or duration * fps > MAX_FRAMES:
        raise UnreadableFile(
            "Too much motion", f"it lasts {duration:.3g} s", hint="cut the animation to the part that is performed"
        )
    frame_count = int(np.floor(duration * fps + 1e-3)) + 1
    if frame_count * len(nodes) > MAX_JOINT_FRAMES:
        raise UnreadableFile(
            "Too much motion",
            f"{frame_count:,} frames of {len(nodes)} joints are more than {MAX_JOINT_FRAMES:,}",
            hint="cut the animation into shorter ones, or export the body's joints only",
        )
    return NodeMotion(tuple(nodes), start, fps, frame_count, tuple(notes), metres_per_unit)


def check_shape_frames(frame_count: int, shape_count: int) -> None:
    """Raise `UnreadableFile` if there are too many blend shapes, or too many weights of them."""
    if shape_count > MAX_SHAPES:
        raise UnreadableFile(
            "Too much motion",
            f"over {MAX_SHAPES:,} of them move",
            hint="export the blend shapes of the face only",
        )
    if frame_count * shape_count > MAX_JOINT_FRAMES:
        raise UnreadableFile(
            "Too much motion",
            f"{frame_count:,} frames of {shape_count:,} blend shapes are more than {MAX_JOINT_FRAMES:,}",
            hint="cut the animation into shorter ones, or export the blend shapes of the face only",
        )
