"""The second pass of the encoder, compiled: sweeps over all coefficients of a block, each moved to where error and bits
together are least, the whole body's error seen at once. The `best` grade.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.codec.bodies import (
    BELOW,
    BELOW_COUNT,
    MOVED,
    MOVED_COUNT,
    PARENT,
    Array,
    Body,
    logarithm,
    multiply,
    multiply_back,
    pose,
    reconstructed,
    rotate,
)
from bunraku.codec.contexts import Seen, nothing_seen, scale, see, see_channel, see_frequency, share
from bunraku.codec.costs import bits
from bunraku.codec.prior import CLASS_OF, HIDDEN, Integers, Prior

_TWIST = 0.03**2
"""Weight of an orientation's error, radians squared against metres squared: what no point shows must stay right too."""
_LEAST = 2
"""Sweeps before it is asked whether a bound is met."""
_HOPELESS = 1.25
_MORE = 3
"""Frequencies above a channel's last that a sweep may use."""


@njit(cache=True, fastmath=True)
def _axes(body: Body, joint: int, axis: int, vectors: Array, orientation: Array, out: Array) -> None:
    """`out` (n, 3): the world's axis and speed of the joint's turning as one of its weighted values grows."""
    unit = body.unweight[joint + 1][:, axis]
    parent, v, q = PARENT[joint], np.zeros(3), np.zeros(4)
    for t in range(len(vectors)):
        r = vectors[t]
        square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
        angle = np.sqrt(square)
        if angle < 1e-4:
            first, second = 0.5, 1 / 6
        else:
            first, second = (1 - np.cos(angle)) / square, (angle - np.sin(angle)) / (square * angle)
        x = r[1] * unit[2] - r[2] * unit[1]
        y = r[2] * unit[0] - r[0] * unit[2]
        z = r[0] * unit[1] - r[1] * unit[0]
        # the left Jacobian of the exponential
        v[0] = unit[0] + first * x + second * (r[1] * z - r[2] * y)
        v[1] = unit[1] + first * y + second * (r[2] * x - r[0] * z)
        v[2] = unit[2] + first * z + second * (r[0] * y - r[1] * x)
        if parent >= 0:
            multiply(orientation[parent, t], body.reference[joint], q)
            rotate(q, v, out[t])
        else:
            rotate(body.reference[joint], v, out[t])


@njit(cache=True, fastmath=True)
def _slopes(
    joint: int, axes: Array, points: Array, off: Array, turned: Array, weight: Array, slope: Array, bend: Array
) -> None:
    """Half of the first and second derivative (n) of the squared error by the joint's value at each frame."""
    slope[:] = 0
    bend[:] = 0
    for i in range(BELOW_COUNT[joint]):
        wrong = turned[BELOW[joint, i]]
        for t in range(len(axes)):
            d = axes[t]
            slope[t] += _TWIST * (wrong[t, 0] * d[0] + wrong[t, 1] * d[1] + wrong[t, 2] * d[2])
            bend[t] += _TWIST * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    for i in range(MOVED_COUNT[joint]):
        point = MOVED[joint, i]
        for t in range(len(axes)):
            d = axes[t]
            a = points[point, t, 0] - points[joint, t, 0]
            b = points[point, t, 1] - points[joint, t, 1]
            c = points[point, t, 2] - points[joint, t, 2]
            x, y, z = d[1] * c - d[2] * b, d[2] * a - d[0] * c, d[0] * b - d[1] * a
            slope[t] += weight[point, t] * (off[point, t, 0] * x + off[point, t, 1] * y + off[point, t, 2] * z)
            bend[t] += weight[point, t] * (x * x + y * y + z * z)


@njit(cache=True, fastmath=True)
def _move(joint: int, axes: Array, change: Array, points: Array, off: Array, turned: Array) -> None:
    """Carry a change (n) of the joint's value into the errors."""
    for i in range(BELOW_COUNT[joint]):
        wrong = turned[BELOW[joint, i]]
        for t in range(len(axes)):
            for x in range(3):
                wrong[t, x] += axes[t, x] * change[t]
    for i in range(MOVED_COUNT[joint]):
        point = MOVED[joint, i]
        for t in range(len(axes)):
            d0, d1, d2 = axes[t, 0] * change[t], axes[t, 1] * change[t], axes[t, 2] * change[t]
            a = points[point, t, 0] - points[joint, t, 0]
            b = points[point, t, 1] - points[joint, t, 1]
            c = points[point, t, 2] - points[joint, t, 2]
            off[point, t, 0] += d1 * c - d2 * b
            off[point, t, 1] += d2 * a - d0 * c
            off[point, t, 2] += d0 * b - d1 * a


@njit(cache=True, fastmath=True)
def _descend(
    prior: Prior,
    costs: Array,
    seen: Seen,
    q: Integers,
    channel: int,
    axis: int,
    sums: Integers,
    basis: Array,
    slope: Array,
    bend: Array,
    size: float,
    price: float,
    change: Array,
) -> bool:
    """One sweep over the frequencies of one axis, of which those of `sums`, their shared context, are used; `change`
    (n) gets how its values move. Whether any did."""
    used, frames = len(sums), basis.shape[1]
    reach = 0
    for x in range(3):
        for k in range(used):
            if q[channel, x, k] != 0:
                reach = max(reach, k + 1)
    reach = min(used, reach + _MORE)
    gradient = np.zeros(reach)
    for k in range(reach):
        for t in range(frames):
            gradient[k] += basis[k, t] * slope[t]
    moved = False
    change[:] = 0
    for k in range(reach):
        curvature = 1e-30
        for t in range(frames):
            curvature += basis[k, t] * basis[k, t] * bend[t]
        now = q[channel, axis, k]
        value = reconstructed(now)
        ideal = value - gradient[k] / curvature / size
        nearest = int(np.round(abs(ideal)))
        expected, before, least, best, fresh = 0, 0.0, -1e-9, now, True
        for less in range(3):
            magnitude = max(nearest - less, 0) if less < 2 else 0
            candidate = magnitude if ideal > 0 else -magnitude
            if candidate == now:
                continue
            by = (reconstructed(candidate) - value) * size
            worse = (2 * by * gradient[k] + by * by * curvature) / (size * size)
            if worse > price * 14:
                continue
            if fresh:
                seen.shared[:] = sums[k]
                expected = scale(prior, seen, channel, axis, k)
                before = bits(costs, CLASS_OF[k], expected, abs(now))
                fresh = False
            cost = worse + price * (bits(costs, CLASS_OF[k], expected, magnitude) - before)
            if cost < least:
                least, best = cost, candidate
        if best != now:
            by = (reconstructed(best) - value) * size
            q[channel, axis, k] = best
            see(seen, channel, axis, k, abs(best))
            see_frequency(seen, channel, k)
            moved = True
            for t in range(frames):
                change[t] += basis[k, t] * by
            for other in range(k + 1, reach):
                coupling = 0.0
                for t in range(frames):
                    coupling += basis[other, t] * basis[k, t] * bend[t]
                gradient[other] += coupling * by
    return moved


@njit(cache=True)
def _errors(true_orientation: Array, true_points: Array, orientation: Array, points: Array, turned: Array) -> Array:
    """How far points are off (23, n, 3); `turned` (18, n, 3) gets how far joints are turned, world axes."""
    q, v = np.zeros(4), np.zeros(3)
    for joint in range(18):
        for t in range(points.shape[1]):
            multiply_back(true_orientation[joint, t], orientation[joint, t], q)
            logarithm(q, v)
            rotate(true_orientation[joint, t], v, turned[joint, t])
    return points - true_points


@njit(cache=True)
def _largest(off: Array) -> float:
    most = 0.0
    for point in range(23):
        for t in range(off.shape[1]):
            e = off[point, t]
            most = max(most, e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
    return np.sqrt(most)  # type: ignore[no-any-return]


@njit(cache=True, fastmath=True)
def _weigh(off: Array, weight: Array, again: bool) -> None:
    """Weights (23, n) that grow with each point's error, so that the largest comes down; `again` half by what they were
    before, as Lawson's iteration finds a least largest error."""
    mean = 0.0
    for point in range(23):
        for t in range(off.shape[1]):
            e = off[point, t]
            mean += np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
    mean = mean / weight.size + 1e-12
    total = 0.0
    for point in range(23):
        for t in range(off.shape[1]):
            e = off[point, t]
            now = (np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) + 0.3 * mean) / (1.3 * mean)
            weight[point, t] = np.sqrt(now * weight[point, t]) if again else now
            total += weight[point, t]
    weight *= weight.size / total


@njit(cache=True, nogil=True)
def refine(
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
    sweeps: int,
    price: float,
    bound: float,
) -> Array:
    """Improve `q` in place, arguments as in `first_pass`: in `sweeps` sweeps at most, a bit at `price` squared steps.
    Where there is a `bound` in metres the largest errors are brought down rather than their squares' sum, until none is
    above it, or that is out of reach. The decoded points (23, n, 3)."""
    count, frames = basis.shape
    vectors, orientation, points = np.zeros((18, frames, 3)), np.zeros((18, frames, 4)), np.zeros((23, frames, 3))
    turned, weight = np.zeros((18, frames, 3)), np.ones((23, frames))
    slope, bend, change = np.zeros(frames), np.zeros(frames), np.zeros(frames)
    axes, sums = np.zeros((frames, 3)), np.zeros((count, 1 + HIDDEN), np.int64)
    for sweep in range(sweeps):
        pose(body, q, size, basis, vectors, orientation, points)
        off = _errors(true_orientation, true_points, orientation, points, turned)
        if bound > 0:
            over = _largest(off) / bound
            if sweep >= _LEAST and (over <= 1 or over > _HOPELESS):
                return points
            _weigh(off, weight, sweep >= _LEAST)
        used = 0
        for k in range(count):
            for track in range(57):
                if q[track // 3, track % 3, k] != 0:
                    used = k + 1
        seen = nothing_seen(count)
        # levels of all are known beforehand: a relative that comes later in the sweep is as it was
        for channel in range(19):
            for k in range(used):
                for axis in range(3):
                    see(seen, channel, axis, k, abs(q[channel, axis, k]))
                see_frequency(seen, channel, k)
        for channel in range(19):
            for k in range(used):
                see_frequency(seen, channel, k)
            for k in range(used):
                share(prior, seen, channel, k, used, step, length)
                sums[k] = seen.shared
            for axis in range(3):
                if channel == 0:
                    per = body.unweight[0][axis, axis]
                    for t in range(frames):
                        slope[t], bend[t] = 0.0, 0.0
                        for point in range(23):
                            slope[t] += weight[point, t] * off[point, t, axis] * per
                            bend[t] += weight[point, t] * per * per
                else:
                    _axes(body, channel - 1, axis, vectors[channel - 1], orientation, axes)
                    _slopes(channel - 1, axes, points, off, turned, weight, slope, bend)
                if not _descend(
                    prior, costs, seen, q, channel, axis, sums[:used], basis, slope, bend, size, price, change
                ):
                    continue
                if channel == 0:
                    for point in range(23):
                        for t in range(frames):
                            off[point, t, axis] += change[t] * body.unweight[0][axis, axis]
                else:
                    _move(channel - 1, axes, change, points, off, turned)
            see_channel(seen, channel, used)
    pose(body, q, size, basis, vectors, orientation, points)
    return points
