"""Division of triangles where a texture varies within them, so that the colours of their corners show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bunraku.motion.rotation import Array
from bunraku.props.surface import Surface, Triangles

CONTRAST = 0.07
"""Difference of a colour from the one between the ends of an edge from which the edge is divided, 0..1."""
MAX_ROUNDS = 8
"""Most divisions of one edge by two."""
_PROBES = (0.25, 0.5, 0.75)


def refine(surface: Surface, shortest: float, max_triangles: int) -> Surface:
    """Return the surface with triangles divided where its textures vary, at most `max_triangles` of them.

    The edges that differ most for their length are divided first; those shorter than `shortest` never.
    """
    for _ in range(MAX_ROUNDS):
        room = max_triangles - len(surface.triangles)
        if room <= 0 or not surface.material.textures:
            break
        edges, edge_of = _find_edges(surface.triangles)
        worth = _rate_edges(surface, edges, shortest)
        order = np.argsort(-worth, kind="stable")
        # each divided edge makes one more triangle of those beside it
        uses = np.bincount(edge_of.reshape(-1), minlength=len(edges))
        chosen = order[(worth[order] > 0.0) & (np.cumsum(uses[order]) <= room)]
        if len(chosen) == 0:
            break
        surface = _divide(surface, edges[chosen], chosen, edge_of, len(edges))
    return surface


def _find_edges(triangles: Triangles) -> tuple[Triangles, Triangles]:
    """Return the edges (e, 2) of triangles, and the number of the edge after each of their corners (n, 3)."""
    following = np.roll(triangles, -1, axis=1)
    ends = np.stack([np.minimum(triangles, following), np.maximum(triangles, following)], axis=-1).reshape(-1, 2)
    edges, edge_of = np.unique(ends, axis=0, return_inverse=True)
    return edges, edge_of.reshape(triangles.shape)


def _rate_edges(surface: Surface, edges: Triangles, shortest: float) -> Array:
    """Return the worth of dividing each edge, 0 if it is not to be divided."""
    start, end = surface.corners[edges[:, 0]], surface.corners[edges[:, 1]]
    length = np.linalg.norm(end[:, :3] - start[:, :3], axis=1)
    first, last = surface.colours_at(start), surface.colours_at(end)
    contrast = np.zeros(len(edges))
    for share in _PROBES:
        between = surface.colours_at(start + share * (end - start))
        contrast = np.maximum(contrast, np.abs(between - first - share * (last - first)).max(axis=1))
    worth: Array = np.where((contrast > CONTRAST) & (length > shortest), contrast * length, 0.0)
    return worth


def _divide(surface: Surface, edges: Triangles, numbers: Triangles, edge_of: Triangles, edge_count: int) -> Surface:
    """Divide `edges`, which have these `numbers`, and the triangles beside them."""
    middles = surface.corners[edges].mean(axis=1)
    lengths = np.linalg.norm(middles[:, 3:6], axis=1, keepdims=True)
    is_clear = lengths > 1e-6
    middles[:, 3:6] = np.where(is_clear, middles[:, 3:6] / np.maximum(lengths, 1e-6), surface.corners[edges[:, 0], 3:6])
    middle_of = np.full(edge_count, -1)
    middle_of[numbers] = len(surface.corners) + np.arange(len(edges))
    parts = _divide_triangles(surface.triangles, middle_of[edge_of])
    return replace(surface, corners=np.vstack([surface.corners, middles]), triangles=parts)


def _divide_triangles(triangles: Triangles, middles: Triangles) -> Triangles:
    """Return the parts of triangles; `middles` (n, 3) has the point on the edge after each corner, -1 if none."""
    count = (middles >= 0).sum(axis=1)
    parts = [triangles[count == 0]]
    # turned so that the divided edge comes first, or the undivided one
    for one, a_divided in ((1, True), (2, False)):
        chosen = count == one
        first = np.argmax((middles[chosen] >= 0) == a_divided, axis=1)
        turned = (first[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(triangles[chosen], turned, axis=1).T
        ab, bc, ca = np.take_along_axis(middles[chosen], turned, axis=1).T
        pieces = [(a, ab, c), (ab, b, c)] if one == 1 else [(ca, bc, c), (a, b, bc), (a, bc, ca)]
        parts += [np.stack(piece, axis=1) for piece in pieces]
    a, b, c = triangles[count == 3].T
    ab, bc, ca = middles[count == 3].T
    parts += [np.stack(piece, axis=1) for piece in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return np.vstack(parts)
