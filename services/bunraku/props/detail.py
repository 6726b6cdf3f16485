"""Division of triangles where a texture varies within them, so that the colours of their corners show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from bunraku.motion.rotation import Array
from bunraku.props.surface import Surface, Triangles

CONTRAST = 0.07
"""Difference of a colour from the one between the ends of an edge from which the edge is divided, 0..1."""
MAX_ROUNDS = 40
"""Most rounds, each of which divides an edge at most once."""
_PROBES = (0.25, 0.5, 0.75)


def refine(surface: Surface, shortest: float, max_triangles: int) -> Surface:
    """Return the surface with triangles divided where its textures vary, at most `max_triangles` of them.

    The edges that differ most for their length are divided first; those shorter than `shortest` only where a longer one
    of their triangles is. With an edge the longest one of its triangles is divided too, so that none gets thin (Rivara,
    "Algorithms for refining triangular grids", 1984).
    """
    for _ in range(MAX_ROUNDS):
        room = max_triangles - len(surface.triangles)
        if room <= 0 or not surface.material.textures:
            break
        edges, edge_of = _find_edges(surface.triangles)
        lengths = np.linalg.norm(np.diff(surface.positions[edges], axis=1)[:, 0], axis=1)
        worth = np.where(lengths > shortest, _rate_edges(surface, edges) * lengths, 0.0)
        wanted = np.argsort(-worth, kind="stable")[: np.count_nonzero(worth)]
        if len(wanted) == 0:
            break
        turned = (lengths[edge_of].argmax(axis=1)[:, None] + np.arange(3)) % 3
        # from here on, the longest edge comes first
        edge_of = np.take_along_axis(edge_of, turned, axis=1)
        surface = replace(surface, triangles=np.take_along_axis(surface.triangles, turned, axis=1))
        chosen = _choose_edges(wanted, edge_of, room)
        if not chosen.any():
            break
        surface = _divide(surface, edges, chosen, edge_of)
    return surface


def _choose_edges(wanted: Triangles, edge_of: Triangles, room: int) -> npt.NDArray[np.bool_]:
    """Return which edges are divided: as many of `wanted` as there is `room` for, and the longest ones beside them."""
    # each divided edge makes one more triangle of those beside it
    uses = np.bincount(edge_of.reshape(-1))
    count = len(wanted)
    while True:
        chosen = np.zeros(len(uses), dtype=bool)
        chosen[wanted[:count]] = True
        while not chosen[beside := edge_of[chosen[edge_of].any(axis=1), 0]].all():
            chosen[beside] = True
        if count == 0 or uses[chosen].sum() <= room:
            return chosen
        count //= 2


def _find_edges(triangles: Triangles) -> tuple[Triangles, Triangles]:
    """Return the edges (e, 2) of triangles, and the number of the edge after each of their corners (n, 3)."""
    following = np.roll(triangles, -1, axis=1)
    ends = np.stack([np.minimum(triangles, following), np.maximum(triangles, following)], axis=-1).reshape(-1, 2)
    edges, edge_of = np.unique(ends, axis=0, return_inverse=True)
    return edges, edge_of.reshape(triangles.shape)


def _rate_edges(surface: Surface, edges: Triangles) -> Array:
    """Return the contrast of the textures along each edge, 0 if it is not seen."""
    start, end = surface.corners[edges[:, 0]], surface.corners[edges[:, 1]]
    first, last = surface.colours_at(start), surface.colours_at(end)
    contrast = np.zeros(len(edges))
    for share in _PROBES:
        between = surface.colours_at(start + share * (end - start))
        contrast = np.maximum(contrast, np.abs(between - first - share * (last - first)).max(axis=1))
    return np.where(contrast > CONTRAST, contrast, 0.0)


def _divide(surface: Surface, edges: Triangles, chosen: npt.NDArray[np.bool_], edge_of: Triangles) -> Surface:
    """Divide the `chosen` edges, and the triangles beside them."""
    ends = surface.corners[edges[chosen]]
    middles = ends.mean(axis=1)
    lengths = np.linalg.norm(middles[:, 3:6], axis=1, keepdims=True)
    is_clear = lengths > 1e-6
    middles[:, 3:6] = np.where(is_clear, middles[:, 3:6] / np.maximum(lengths, 1e-6), ends[:, 0, 3:6])
    middle_of = np.full(len(edges), -1)
    middle_of[chosen] = len(surface.corners) + np.arange(len(middles))
    parts = _divide_triangles(surface.triangles, middle_of[edge_of])
    return replace(surface, corners=np.vstack([surface.corners, middles]), triangles=parts)


def _divide_triangles(triangles: Triangles, middles: Triangles) -> Triangles:
    """Return the parts of triangles; `middles` (n, 3) has the point on the edge after each corner, -1 if none.

    The first edge of a triangle is divided if any is: its point is joined to the opposite corner, and to the others.
    """
    whole = middles[:, 0] < 0
    a, b, c = triangles[~whole].T
    ab, bc, ca = middles[~whole].T
    parts = [triangles[whole]]
    for middle, (start, end) in ((ca, (c, a)), (bc, (b, c))):
        halved = middle >= 0
        parts.append(np.stack([ab, start, end], axis=1)[~halved])
        parts += [np.stack(part, axis=1)[halved] for part in ((ab, start, middle), (ab, middle, end))]
    return np.vstack(parts)
