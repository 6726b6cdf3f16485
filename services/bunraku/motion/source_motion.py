"""Recorded motion of any skeleton, as the readers of files return it and the analysis takes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from bunraku.motion import rotation
from bunraku.motion.rotation import Array

NTSC_RATES = (24_000 / 1_001, 30_000 / 1_001, 60_000 / 1_001, 120_000 / 1_001)
"""Frame rates that are called 23.976, 29.97, 59.94 and 119.88."""


@dataclass(frozen=True, slots=True)
class EndSite:
    """End of the last bone of a chain: `offset` (3,) from joint `parent`, in its frame and the source's units."""

    parent: int
    offset: Array


class SourceMotion(Protocol):
    """Motion of J joints in the source's units, axes and names; parents come before their children.

    Its rest pose may be any; the source's rotations begin there.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints, not necessarily unique."""

    @property
    def parents(self) -> tuple[int, ...]:
        """Parent of each joint, -1 for the root."""

    @property
    def ends(self) -> tuple[EndSite, ...]:
        """Ends of bones beyond the joints."""

    @property
    def joint_lines(self) -> tuple[int | None, ...]:
        """Line of the file that declares each joint; None where a format has no lines."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences about irregularities."""

    @property
    def metres_per_unit(self) -> float | None:
        """Unit of length that the file declares, in metres; None if it declares none."""

    @property
    def fps(self) -> float:
        """Frames per second."""

    @property
    def frame_count(self) -> int:
        """Number of frames."""

    @property
    def rest_positions(self) -> Array:
        """World positions (J, 3) at rest, the root at the origin."""

    @property
    def rest_orientations(self) -> Array:
        """World orientations (J, 4) at rest."""

    @property
    def expressions(self) -> dict[str, Array]:
        """Weights (n,) of blend shapes in all frames by their names in the file; of a gaze, radians."""

    def world_transforms(self, joints: list[int], frames: npt.NDArray[np.int64] | None = None) -> tuple[Array, Array]:
        """Return world positions (n, J, 3) and orientations (n, J, 4) of `joints` and their ancestors.

        `frames` selects frames by index (default: all). What other joints have is undefined.
        """


@dataclass(frozen=True, slots=True)
class SampledMotion:
    """Source motion whose world transforms are known: `positions` (n, J, 3) and `orientations` (n, J, 4)."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    ends: tuple[EndSite, ...]
    fps: float
    rest_positions: Array
    rest_orientations: Array
    positions: Array
    orientations: Array
    notes: tuple[str, ...] = ()
    metres_per_unit: float | None = None
    expressions: dict[str, Array] = field(default_factory=dict)

    @property
    def joint_lines(self) -> tuple[int | None, ...]:
        """Lines of the joints: none."""
        return (None,) * len(self.names)

    @property
    def frame_count(self) -> int:
        """Number of frames."""
        return len(self.positions)

    def world_transforms(self, joints: list[int], frames: npt.NDArray[np.int64] | None = None) -> tuple[Array, Array]:
        """Return world positions (n, J, 3) and orientations (n, J, 4) of `joints`, and of all others."""
        del joints
        if frames is None:
            return self.positions, self.orientations
        return self.positions[frames], self.orientations[frames]


def chain_transforms(parents: Sequence[int], offsets: Array, rotations: Array) -> tuple[Array, Array]:
    """Return world positions (..., J, 3) and orientations (..., J, 4) of joints with the given local transforms.

    `offsets` (..., J, 3) and `rotations` (..., J, 4) are relative to the parents.
    """
    positions, orientations = offsets.copy(), rotations.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            above = orientations[..., parent, :]
            positions[..., joint, :] = positions[..., parent, :] + rotation.rotate(above, offsets[..., joint, :])
            orientations[..., joint, :] = rotation.multiply(above, rotations[..., joint, :])
    return positions, orientations


def bone_lengths(source: SourceMotion) -> Array:
    """Return each joint's distance (J,) from its parent at rest, 0 for the root."""
    positions = source.rest_positions
    lengths: Array = np.linalg.norm(positions - positions[list(source.parents)], axis=1)
    lengths[[joint for joint, parent in enumerate(source.parents) if parent < 0]] = 0.0
    return lengths
