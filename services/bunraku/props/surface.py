"""Triangles of one material."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from bunraku.motion.rotation import Array
from bunraku.props.material import ALPHA, Material
from bunraku.props.texture import linear_to_srgb

Triangles = npt.NDArray[np.int64]
"""Corners (n, 3), counter-clockwise as seen from outside."""
_COLOURS, _COORDINATES = 6, 10


@dataclass(frozen=True, slots=True)
class Surface:
    """Triangles of one material."""

    corners: Array
    """Position, normal, linear colour with opacity and coordinates of each texture, (n, 10 + 2 k)."""
    triangles: Triangles
    material: Material

    @property
    def positions(self) -> Array:
        """Positions of the corners (n, 3)."""
        return self.corners[:, :3]

    @property
    def normals(self) -> Array:
        """Unit normals of the corners (n, 3)."""
        return self.corners[:, 3:6]

    def look_at(self, corners: Array) -> Array:
        """Return the look of points of the surface, given as its corners are."""
        return self.material.look(corners[:, _COORDINATES:], corners[:, _COLOURS:_COORDINATES])

    def colours_at(self, corners: Array) -> Array:
        """Return the colours and opacity of points as they are seen, in the transfer function of sRGB."""
        return linear_to_srgb(self.look_at(corners)[:, :4])

    def with_back(self) -> Self:
        """Return the surface with its back, if both sides are seen: it is double-sided, and not closed."""
        if not self.material.is_double_sided or self._is_closed():
            return self
        back = self.corners.copy()
        back[:, 3:6] *= -1.0
        reversed_triangles = self.triangles[:, ::-1] + len(self.corners)
        return replace(
            self, corners=np.vstack([self.corners, back]), triangles=np.vstack([self.triangles, reversed_triangles])
        )

    def without_hidden(self) -> Self:
        """Return the surface without the triangles of which no corner is opaque enough to be seen."""
        if self.material.hidden_below <= 0.0:
            return self
        is_hidden = self.look_at(self.corners)[:, ALPHA] < self.material.hidden_below
        return replace(self, triangles=self.triangles[~is_hidden[self.triangles].all(axis=1)])

    def _is_closed(self) -> bool:
        """Return whether each edge has a triangle on both of its sides."""
        _, welded = np.unique(self.positions.round(6), axis=0, return_inverse=True)
        triangles = welded.reshape(-1)[self.triangles]
        edges = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        edges = edges[edges[:, 0] != edges[:, 1]]
        size = len(self.corners)
        there, back = (np.sort(edges[:, a] * size + edges[:, b]) for a, b in ((0, 1), (1, 0)))
        return bool(np.array_equal(there, back))
