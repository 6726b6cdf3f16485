"""The first pass of the encoder, compiled: channel by channel from the root outwards, each joint aiming at where its
children truly are from where its parent was decoded to be. Causal and quick; alone it is the `live` grade.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.codec.bodies import (
    CHILD_COUNT,
    CHILDREN,
    PARENT,
    TIP_OF,
    Array,
    Body,
    exponential,
    logarithm,
    multiply,
    multiply_back,
    place_children,
    reconstructed,
    rotate,
    spectrum,
    transform,
    turn,
    values,
)
from bunraku.codec.contexts import Seen, nothing_seen, scale, see, see_channel, see_frequency, share
from bunraku.codec.costs import bits
from bunraku.codec.prior import CLASS_OF, Integers, Prior

AIM = 0.85
"""Share of the least-squares correction that is taken: all of it would chase the quantiser's noise."""
_STIFF = 0.05**2
_PRICE = 0.2
"""What a bit costs against a squared error of one step."""


@njit(cache=True)
def _choose(
    prior: Prior,
    costs: Array,
    seen: Seen,
    q: Integers,
    channel: int,
    wanted: Array,
    size: float,
    step: int,
    length: int,
) -> None:
    """Quantise `wanted` (K, 3), coefficients of one channel in the quantiser's scale, by error and bits."""
    count = len(wanted)
    for k in range(count):
        fresh = True
        for axis in range(3):
            ideal = abs(wanted[k, axis]) / size
            nearest, best = int(ideal + 0.5), 0
            if nearest > 0:
                if fresh:
                    share(prior, seen, channel, k, count, step, length)
                    fresh = False
                expected = scale(prior, seen, channel, axis, k)
                least = np.inf
                for candidate in (nearest, nearest - 1, 0):
                    off = ideal - reconstructed(candidate)
                    cost = off * off + _PRICE * bits(costs, CLASS_OF[k], expected, candidate)
                    if cost < least:
                        least, best = cost, candidate
            q[channel, axis, k] = best if wanted[k, axis] > 0 else -best
            see(seen, channel, axis, k, best)
        see_frequency(seen, channel, k)
    see_channel(seen, channel, count)


@njit(cache=True)
def _solve(a: Array, b: Array, out: Array) -> None:
    """`out` = the solution of a symmetric positive system (3, 3), by Cramer's rule."""
    p = a[1, 1] * a[2, 2] - a[1, 2] * a[1, 2]
    r = a[0, 1] * a[2, 2] - a[1, 2] * a[0, 2]
    s = a[0, 1] * a[1, 2] - a[1, 1] * a[0, 2]
    determinant = a[0, 0] * p - a[0, 1] * r + a[0, 2] * s
    u = b[1] * a[2, 2] - a[1, 2] * b[2]
    v = b[1] * a[1, 2] - a[1, 1] * b[2]
    w = a[0, 1] * b[2] - b[1] * a[0, 2]
    out[0] = (b[0] * p - a[0, 1] * u + a[0, 2] * v) / determinant
    out[1] = (a[0, 0] * u - b[0] * r + a[0, 2] * w) / determinant
    out[2] = (-a[0, 0] * v - a[0, 1] * w + b[0] * s) / determinant


@njit(cache=True)
def _aim(body: Body, joint: int, orientation: Array, off: Array, aimed: Array) -> None:
    """The true world `orientation` of a joint that stands `off` its place, turned so that its children are nearer."""
    a, b, arm, delta, q = np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(4)
    for i in range(CHILD_COUNT[joint] + 1):
        if i < CHILD_COUNT[joint]:
            rotate(orientation, body.offsets[CHILDREN[joint, i]], arm)
        elif TIP_OF[joint] >= 0:
            rotate(orientation, body.tips[joint], arm)
        else:
            break
        square = arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2]
        for x in range(3):
            for y in range(3):
                a[x, y] -= arm[x] * arm[y]
            a[x, x] += square
        b[0] += arm[1] * off[2] - arm[2] * off[1]
        b[1] += arm[2] * off[0] - arm[0] * off[2]
        b[2] += arm[0] * off[1] - arm[1] * off[0]
    for x in range(3):
        a[x, x] += _STIFF
    _solve(a, b, delta)
    for x in range(3):
        delta[x] *= AIM
    exponential(delta, q)
    multiply(q, orientation, aimed)


@njit(cache=True, nogil=True)
def first_pass(
    prior: Prior,
    costs: Array,
    body: Body,
    true_orientation: Array,
    true_points: Array,
    basis: Array,
    size: float,
    step: int,
    length: int,
    q: Integers,
) -> Array:
    """Fill `q` (19, 3, K) for a block whose true pose is `true_orientation` (18, n, 4), `true_points` (23, n, 3); K
    rows of cosines `basis` (K, n); quantiser step `size` of index `step`. The decoded points (23, n, 3)."""
    frames = basis.shape[1]
    seen = nothing_seen(basis.shape[0])
    orientation, points = np.zeros((18, frames, 4)), np.zeros((23, frames, 3))
    weighted = np.zeros((frames, 3))
    for t in range(frames):
        transform(body.weight[0], true_points[0, t], weighted[t])
    _choose(prior, costs, seen, q, 0, spectrum(basis, weighted), size, step, length)
    points[0] = values(q, 0, size, body.unweight[0], basis)
    aimed, v, before, off = np.zeros(4), np.zeros(3), np.zeros(3), np.zeros(3)
    for joint in range(18):
        parent = PARENT[joint]
        for t in range(frames):
            for x in range(3):
                off[x] = true_points[joint, t, x] - points[joint, t, x]
            _aim(body, joint, true_orientation[joint, t], off, aimed)
            if parent >= 0:
                multiply_back(orientation[parent, t], aimed, aimed)
            multiply_back(body.reference[joint], aimed, aimed)
            logarithm(aimed, v)
            angle = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
            if t > 0 and angle > 1e-6:
                # of all turns that look the same, the one nearest to the frame before
                along = (v[0] * before[0] + v[1] * before[1] + v[2] * before[2]) / angle
                whole = np.round((along - angle) / (2 * np.pi)) * 2 * np.pi
                for x in range(3):
                    v[x] += v[x] / angle * whole
            before[:] = v
            transform(body.weight[joint + 1], v, weighted[t])
        _choose(prior, costs, seen, q, joint + 1, spectrum(basis, weighted), size, step, length)
        turn(body, joint, values(q, joint + 1, size, body.unweight[joint + 1], basis), orientation)
        place_children(body, joint, orientation, points)
    return points
