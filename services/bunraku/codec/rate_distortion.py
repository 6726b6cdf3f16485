"""The second pass of the encoder, compiled: sweeps over all coefficients of a block, each moved to where error and bits
together are least, the whole body's error seen at once. The `best` grade.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.codec.bit_cost import coefficient_bits
from bunraku.codec.context_model import (
    ContextModel,
    compute_shared_sums,
    create_context_model,
    finish_channel,
    finish_frequency,
    predict_scale,
    update_magnitude,
)
from bunraku.codec.forward_kinematics import (
    DESCENDANT_COUNT,
    DESCENDANTS,
    MOVED_POINT_COUNT,
    MOVED_POINTS,
    PARENT,
    Array,
    KinematicChain,
    compute_pose,
    multiply,
    multiply_inverse,
    reconstruct,
    rotate,
    to_rotation_vector,
)
from bunraku.codec.prior import FREQUENCY_CLASS_OF, HIDDEN_UNITS, IntArray, Prior

_ORIENTATION_WEIGHT_M2 = 0.03**2
"""Weight of an orientation's error, radians squared against metres squared: what no point shows must stay right too."""
_MIN_SWEEPS = 2
"""Sweeps before it is asked whether a bound is met."""
_UNREACHABLE_ERROR_RATIO = 1.25
_EXTRA_FREQUENCIES = 3
"""Frequencies above a channel's last that a sweep may use."""


@njit(cache=True, fastmath=True)
def _rotation_axes(
    chain: KinematicChain, joint: int, axis: int, vectors: Array, orientation: Array, out: Array
) -> None:
    """`out` (n, 3): the world's axis and speed of the joint's turning as one of its weighted values grows."""
    unit = chain.inverse_weight[joint + 1][:, axis]
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
            multiply(orientation[parent, t], chain.reference[joint], q)
            rotate(q, v, out[t])
        else:
            rotate(chain.reference[joint], v, out[t])


@njit(cache=True, fastmath=True)
def _error_derivatives(
    joint: int,
    axes: Array,
    points: Array,
    point_errors: Array,
    rotation_errors: Array,
    weight: Array,
    first_derivative: Array,
    second_derivative: Array,
) -> None:
    """Half of the first and second derivative (n) of the squared error by the joint's value at each frame."""
    first_derivative[:] = 0
    second_derivative[:] = 0
    for i in range(DESCENDANT_COUNT[joint]):
        wrong = rotation_errors[DESCENDANTS[joint, i]]
        for t in range(len(axes)):
            d = axes[t]
            first_derivative[t] += _ORIENTATION_WEIGHT_M2 * (
                wrong[t, 0] * d[0] + wrong[t, 1] * d[1] + wrong[t, 2] * d[2]
            )
            second_derivative[t] += _ORIENTATION_WEIGHT_M2 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    for i in range(MOVED_POINT_COUNT[joint]):
        point = MOVED_POINTS[joint, i]
        for t in range(len(axes)):
            d = axes[t]
            a = points[point, t, 0] - points[joint, t, 0]
            b = points[point, t, 1] - points[joint, t, 1]
            c = points[point, t, 2] - points[joint, t, 2]
            x, y, z = d[1] * c - d[2] * b, d[2] * a - d[0] * c, d[0] * b - d[1] * a
            first_derivative[t] += weight[point, t] * (
                point_errors[point, t, 0] * x + point_errors[point, t, 1] * y + point_errors[point, t, 2] * z
            )
            second_derivative[t] += weight[point, t] * (x * x + y * y + z * z)


@njit(cache=True, fastmath=True)
def _apply_change(
    joint: int, axes: Array, change: Array, points: Array, point_errors: Array, rotation_errors: Array
) -> None:
    """Carry a change (n) of the joint's value into the errors."""
    for i in range(DESCENDANT_COUNT[joint]):
        wrong = rotation_errors[DESCENDANTS[joint, i]]
        for t in range(len(axes)):
            for x in range(3):
                wrong[t, x] += axes[t, x] * change[t]
    for i in range(MOVED_POINT_COUNT[joint]):
        point = MOVED_POINTS[joint, i]
        for t in range(len(axes)):
            d0, d1, d2 = axes[t, 0] * change[t], axes[t, 1] * change[t], axes[t, 2] * change[t]
            a = points[point, t, 0] - points[joint, t, 0]
            b = points[point, t, 1] - points[joint, t, 1]
            c = points[point, t, 2] - points[joint, t, 2]
            point_errors[point, t, 0] += d1 * c - d2 * b
            point_errors[point, t, 1] += d2 * a - d0 * c
            point_errors[point, t, 2] += d0 * b - d1 * a


@njit(cache=True, fastmath=True)
def _sweep_axis(
    prior: Prior,
    cost_table: Array,
    context: ContextModel,
    q: IntArray,
    channel: int,
    axis: int,
    shared_sums: IntArray,
    basis: Array,
    first_derivative: Array,
    second_derivative: Array,
    step_size: float,
    bit_price: float,
    change: Array,
) -> bool:
    """One sweep over the frequencies of one axis, of which those of `sums`, their shared context, are used; `change`
    (n) gets how its values move. Whether any did."""
    used, frames = len(shared_sums), basis.shape[1]
    reach = 0
    for x in range(3):
        for k in range(used):
            if q[channel, x, k] != 0:
                reach = max(reach, k + 1)
    reach = min(used, reach + _EXTRA_FREQUENCIES)
    gradient = np.zeros(reach)
    for k in range(reach):
        for t in range(frames):
            gradient[k] += basis[k, t] * first_derivative[t]
    moved = False
    change[:] = 0
    for k in range(reach):
        curvature = 1e-30
        for t in range(frames):
            curvature += basis[k, t] * basis[k, t] * second_derivative[t]
        now = q[channel, axis, k]
        value = reconstruct(now)
        ideal = value - gradient[k] / curvature / step_size
        nearest = int(np.round(abs(ideal)))
        expected, before, least, best, fresh = 0, 0.0, -1e-9, now, True
        for less in range(3):
            magnitude = max(nearest - less, 0) if less < 2 else 0
            candidate = magnitude if ideal > 0 else -magnitude
            if candidate == now:
                continue
            by = (reconstruct(candidate) - value) * step_size
            worse = (2 * by * gradient[k] + by * by * curvature) / (step_size * step_size)
            if worse > bit_price * 14:
                continue
            if fresh:
                context.shared_sums[:] = shared_sums[k]
                expected = predict_scale(prior, context, channel, axis, k)
                before = coefficient_bits(cost_table, FREQUENCY_CLASS_OF[k], expected, abs(now))
                fresh = False
            cost = worse + bit_price * (
                coefficient_bits(cost_table, FREQUENCY_CLASS_OF[k], expected, magnitude) - before
            )
            if cost < least:
                least, best = cost, candidate
        if best != now:
            by = (reconstruct(best) - value) * step_size
            q[channel, axis, k] = best
            update_magnitude(context, channel, axis, k, abs(best))
            finish_frequency(context, channel, k)
            moved = True
            for t in range(frames):
                change[t] += basis[k, t] * by
            for other in range(k + 1, reach):
                coupling = 0.0
                for t in range(frames):
                    coupling += basis[other, t] * basis[k, t] * second_derivative[t]
                gradient[other] += coupling * by
    return moved


@njit(cache=True)
def _pose_errors(
    true_orientation: Array, true_points: Array, orientation: Array, points: Array, rotation_errors: Array
) -> Array:
    """How far points are off (23, n, 3); `turned` (18, n, 3) gets how far joints are turned, world axes."""
    q, v = np.zeros(4), np.zeros(3)
    for joint in range(18):
        for t in range(points.shape[1]):
            multiply_inverse(true_orientation[joint, t], orientation[joint, t], q)
            to_rotation_vector(q, v)
            rotate(true_orientation[joint, t], v, rotation_errors[joint, t])
    return points - true_points


@njit(cache=True)
def _max_error(point_errors: Array) -> float:
    most = 0.0
    for point in range(23):
        for t in range(point_errors.shape[1]):
            e = point_errors[point, t]
            most = max(most, e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
    return np.sqrt(most)  # type: ignore[no-any-return]


@njit(cache=True, fastmath=True)
def _update_weights(point_errors: Array, weight: Array, blend_previous: bool) -> None:
    """Weights (23, n) that grow with each point's error, so that the largest comes down; `again` half by what they were
    before, as Lawson's iteration finds a least largest error."""
    mean = 0.0
    for point in range(23):
        for t in range(point_errors.shape[1]):
            e = point_errors[point, t]
            mean += np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
    mean = mean / weight.size + 1e-12
    total = 0.0
    for point in range(23):
        for t in range(point_errors.shape[1]):
            e = point_errors[point, t]
            now = (np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) + 0.3 * mean) / (1.3 * mean)
            weight[point, t] = np.sqrt(now * weight[point, t]) if blend_previous else now
            total += weight[point, t]
    weight *= weight.size / total


@njit(cache=True, nogil=True)
def refine_coefficients(
    prior: Prior,
    cost_table: Array,
    chain: KinematicChain,
    true_orientation: Array,
    true_points: Array,
    basis: Array,
    step_size: float,
    step: int,
    duration_level: int,
    q: IntArray,
    max_sweeps: int,
    bit_price: float,
    error_bound_m: float,
) -> Array:
    """Improve `q` in place, arguments as in `first_pass`: in `sweeps` sweeps at most, a bit at `price` squared steps.
    Where there is a `bound` in metres the largest errors are brought down rather than their squares' sum, until none is
    above it, or that is out of reach. The decoded points (23, n, 3)."""
    count, frames = basis.shape
    vectors, orientation, points = np.zeros((18, frames, 3)), np.zeros((18, frames, 4)), np.zeros((23, frames, 3))
    turned, weight = np.zeros((18, frames, 3)), np.ones((23, frames))
    slope, bend, change = np.zeros(frames), np.zeros(frames), np.zeros(frames)
    axes, sums = np.zeros((frames, 3)), np.zeros((count, 1 + HIDDEN_UNITS), np.int64)
    for sweep in range(max_sweeps):
        compute_pose(chain, q, step_size, basis, vectors, orientation, points)
        off = _pose_errors(true_orientation, true_points, orientation, points, turned)
        if error_bound_m > 0:
            over = _max_error(off) / error_bound_m
            if sweep >= _MIN_SWEEPS and (over <= 1 or over > _UNREACHABLE_ERROR_RATIO):
                return points
            _update_weights(off, weight, sweep >= _MIN_SWEEPS)
        used = 0
        for k in range(count):
            for track in range(57):
                if q[track // 3, track % 3, k] != 0:
                    used = k + 1
        seen = create_context_model(count)
        # levels of all are known beforehand: a relative that comes later in the sweep is as it was
        for channel in range(19):
            for k in range(used):
                for axis in range(3):
                    update_magnitude(seen, channel, axis, k, abs(q[channel, axis, k]))
                finish_frequency(seen, channel, k)
        for channel in range(19):
            for k in range(used):
                finish_frequency(seen, channel, k)
            for k in range(used):
                compute_shared_sums(prior, seen, channel, k, used, step, duration_level)
                sums[k] = seen.shared_sums
            for axis in range(3):
                if channel == 0:
                    per = chain.inverse_weight[0][axis, axis]
                    for t in range(frames):
                        slope[t], bend[t] = 0.0, 0.0
                        for point in range(23):
                            slope[t] += weight[point, t] * off[point, t, axis] * per
                            bend[t] += weight[point, t] * per * per
                else:
                    _rotation_axes(chain, channel - 1, axis, vectors[channel - 1], orientation, axes)
                    _error_derivatives(channel - 1, axes, points, off, turned, weight, slope, bend)
                if not _sweep_axis(
                    prior,
                    cost_table,
                    seen,
                    q,
                    channel,
                    axis,
                    sums[:used],
                    basis,
                    slope,
                    bend,
                    step_size,
                    bit_price,
                    change,
                ):
                    continue
                if channel == 0:
                    for point in range(23):
                        for t in range(frames):
                            off[point, t, axis] += change[t] * chain.inverse_weight[0][axis, axis]
                else:
                    _apply_change(channel - 1, axes, change, points, off, turned)
            finish_channel(seen, channel, used)
    compute_pose(chain, q, step_size, basis, vectors, orientation, points)
    return points
