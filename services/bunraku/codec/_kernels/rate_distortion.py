"""Second pass of the encoder: rate-distortion optimisation, which the `best` grade adds.

Sweeps over all coefficients of a block move each one to the lowest sum of error and bits. The error is that of the
whole body, linearised about the current pose.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bunraku.codec._kernels.bit_cost import coefficient_bits
from bunraku.codec._kernels.context_model import (
    ContextModel,
    compute_shared_sums,
    create_context_model,
    finish_channel,
    finish_frequency,
    predict_scale,
    update_magnitude,
)
from bunraku.codec._kernels.forward_kinematics import (
    DESCENDANT_COUNT,
    DESCENDANTS,
    MOVED_POINT_COUNT,
    MOVED_POINTS,
    PARENT,
    POINT_COUNT,
    Pose,
    compute_pose,
    create_pose,
    reconstruct,
)
from bunraku.codec._kernels.rotation import multiply, multiply_inverse, rotate, to_rotation_vector
from bunraku.codec.block_input import BlockInput, KinematicChain, Refinement
from bunraku.codec.prior import FREQUENCY_CLASS_OF, HIDDEN_UNITS, IntArray
from bunraku.motion.rotation import Array

_ORIENTATION_WEIGHT_M2 = 0.03**2
"""Weight of a squared orientation error (rad^2) against a squared position error (m^2).

It keeps rotations right that no point shows.
"""
_MIN_SWEEPS = 2
"""Sweeps before the error bound is checked."""
_UNREACHABLE_ERROR_RATIO = 1.25
"""Largest error over the bound above which the bound is given up."""
_EXTRA_FREQUENCIES = 3
"""Frequencies above a channel's last that a sweep may use."""
_MAX_ERROR_BITS = 14
"""A candidate is skipped if its error costs more than this many bits."""


class BlockError(NamedTuple):
    """Errors of the current pose: `position` (23, n, 3) of points in metres, `rotation` (18, n, 3) of joints as world
    rotation vectors, and the `weight` (23, n) of each squared position error."""

    position: Array
    rotation: Array
    weight: Array


class AxisSlope(NamedTuple):
    """Effect of one value of a channel on the error, by frame.

    `axes` (n, 3) is the world rotation of the joint by unit of the value. `first` and `second` (n) are half of the
    derivatives of the squared error. `change` (n) is how a sweep moves the value.
    """

    axes: Array
    first: Array
    second: Array
    change: Array


class Sweep(NamedTuple):
    """State of one sweep: the context model, in which all levels are known from the start, and the shared sums
    (K, 1 + HIDDEN_UNITS) of the current channel."""

    block: BlockInput
    context: ContextModel
    shared_sums: IntArray
    bit_price: float


@njit(cache=True, fastmath=True)
def rotation_axes(chain: KinematicChain, joint: int, axis: int, pose: Pose, out: Array) -> None:
    """Compute the world rotation (n, 3) of a joint by unit of one of its weighted values."""
    unit = chain.inverse_weight[joint + 1][:, axis]
    vectors, orientation = pose.vectors[joint], pose.orientation
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
        # left Jacobian of the exponential map
        v[0] = unit[0] + first * x + second * (r[1] * z - r[2] * y)
        v[1] = unit[1] + first * y + second * (r[2] * x - r[0] * z)
        v[2] = unit[2] + first * z + second * (r[0] * y - r[1] * x)
        if parent >= 0:
            multiply(orientation[parent, t], chain.reference[joint], q)
            rotate(q, v, out[t])
        else:
            rotate(chain.reference[joint], v, out[t])


@njit(cache=True, fastmath=True)
def _error_derivatives(joint: int, points: Array, error: BlockError, slope: AxisSlope) -> None:
    """Compute half of the first and second derivative of the squared error by a joint's value."""
    axes, weight = slope.axes, error.weight
    first, second = slope.first, slope.second
    first[:] = 0
    second[:] = 0
    for i in range(DESCENDANT_COUNT[joint]):
        e = error.rotation[DESCENDANTS[joint, i]]
        for t in range(len(axes)):
            d = axes[t]
            first[t] += _ORIENTATION_WEIGHT_M2 * (e[t, 0] * d[0] + e[t, 1] * d[1] + e[t, 2] * d[2])
            second[t] += _ORIENTATION_WEIGHT_M2 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    for i in range(MOVED_POINT_COUNT[joint]):
        point = MOVED_POINTS[joint, i]
        e = error.position[point]
        for t in range(len(axes)):
            d = axes[t]
            a = points[point, t, 0] - points[joint, t, 0]
            b = points[point, t, 1] - points[joint, t, 1]
            c = points[point, t, 2] - points[joint, t, 2]
            x, y, z = d[1] * c - d[2] * b, d[2] * a - d[0] * c, d[0] * b - d[1] * a
            first[t] += weight[point, t] * (e[t, 0] * x + e[t, 1] * y + e[t, 2] * z)
            second[t] += weight[point, t] * (x * x + y * y + z * z)


@njit(cache=True)
def _root_derivatives(axis: int, scale: float, error: BlockError, slope: AxisSlope) -> None:
    """Compute the same derivatives by a coordinate of the root, of which a unit moves all points by `scale`."""
    for t in range(len(slope.first)):
        slope.first[t], slope.second[t] = 0.0, 0.0
        for point in range(POINT_COUNT):
            slope.first[t] += error.weight[point, t] * error.position[point, t, axis] * scale
            slope.second[t] += error.weight[point, t] * scale * scale


@njit(cache=True, fastmath=True)
def _apply_change(joint: int, points: Array, error: BlockError, slope: AxisSlope) -> None:
    """Add the effect of `slope.change` of a joint's value to the errors."""
    axes, change = slope.axes, slope.change
    for i in range(DESCENDANT_COUNT[joint]):
        e = error.rotation[DESCENDANTS[joint, i]]
        for t in range(len(axes)):
            for x in range(3):
                e[t, x] += axes[t, x] * change[t]
    for i in range(MOVED_POINT_COUNT[joint]):
        point = MOVED_POINTS[joint, i]
        e = error.position[point]
        for t in range(len(axes)):
            d0, d1, d2 = axes[t, 0] * change[t], axes[t, 1] * change[t], axes[t, 2] * change[t]
            a = points[point, t, 0] - points[joint, t, 0]
            b = points[point, t, 1] - points[joint, t, 1]
            c = points[point, t, 2] - points[joint, t, 2]
            e[t, 0] += d1 * c - d2 * b
            e[t, 1] += d2 * a - d0 * c
            e[t, 2] += d0 * b - d1 * a


@njit(cache=True, fastmath=True)
def _sweep_axis(sweep: Sweep, q: IntArray, channel: int, axis: int, slope: AxisSlope) -> bool:
    """Optimise the coefficients of one axis; return whether any changed. `slope.change` receives the effect."""
    context, quantiser, costs = sweep.context, sweep.block.quantiser, sweep.block.costs
    basis, step_size, bit_price = quantiser.basis, quantiser.step_size, sweep.bit_price
    used, frames = context.frequencies, basis.shape[1]
    reach = 0
    for x in range(3):
        for k in range(used):
            if q[channel, x, k] != 0:
                reach = max(reach, k + 1)
    reach = min(used, reach + _EXTRA_FREQUENCIES)
    gradient = np.zeros(reach)
    for k in range(reach):
        for t in range(frames):
            gradient[k] += basis[k, t] * slope.first[t]
    moved = False
    slope.change[:] = 0
    for k in range(reach):
        curvature = 1e-30
        for t in range(frames):
            curvature += basis[k, t] * basis[k, t] * slope.second[t]
        current = q[channel, axis, k]
        value = reconstruct(current)
        ideal = value - gradient[k] / curvature / step_size
        nearest = int(np.round(abs(ideal)))
        scale, current_bits, lowest_cost, best, needs_scale = 0, 0.0, -1e-9, current, True
        for less in range(3):
            magnitude = max(nearest - less, 0) if less < 2 else 0
            candidate = magnitude if ideal > 0 else -magnitude
            if candidate == current:
                continue
            delta = (reconstruct(candidate) - value) * step_size
            added_error = (2 * delta * gradient[k] + delta * delta * curvature) / (step_size * step_size)
            if added_error > bit_price * _MAX_ERROR_BITS:
                continue
            if needs_scale:
                context.shared_sums[:] = sweep.shared_sums[k]
                scale = predict_scale(context, channel, axis, k)
                current_bits = coefficient_bits(costs, FREQUENCY_CLASS_OF[k], scale, abs(current))
                needs_scale = False
            bits = coefficient_bits(costs, FREQUENCY_CLASS_OF[k], scale, magnitude)
            cost = added_error + bit_price * (bits - current_bits)
            if cost < lowest_cost:
                lowest_cost, best = cost, candidate
        if best != current:
            delta = (reconstruct(best) - value) * step_size
            q[channel, axis, k] = best
            update_magnitude(context, channel, axis, k, abs(best))
            finish_frequency(context, channel, k)
            moved = True
            for t in range(frames):
                slope.change[t] += basis[k, t] * delta
            for other in range(k + 1, reach):
                coupling = 0.0
                for t in range(frames):
                    coupling += basis[other, t] * basis[k, t] * slope.second[t]
                gradient[other] += coupling * delta
    return moved


@njit(cache=True)
def _measure_errors(block: BlockInput, pose: Pose, error: BlockError) -> None:
    """Compute the errors of `pose`; the weights stay."""
    q, v = np.zeros(4), np.zeros(3)
    for joint in range(18):
        for t in range(pose.points.shape[1]):
            multiply_inverse(block.orientation[joint, t], pose.orientation[joint, t], q)
            to_rotation_vector(q, v)
            rotate(block.orientation[joint, t], v, error.rotation[joint, t])
    error.position[:] = pose.points - block.points


@njit(cache=True)
def _max_error(error: BlockError) -> float:
    largest = 0.0
    for point in range(POINT_COUNT):
        for t in range(error.position.shape[1]):
            e = error.position[point, t]
            largest = max(largest, e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
    return np.sqrt(largest)  # type: ignore[no-any-return]


@njit(cache=True, fastmath=True)
def _update_weights(error: BlockError, blend_previous: bool) -> None:
    """Raise the weights of points with large errors, so that the largest error decreases.

    With `blend_previous` the result is the geometric mean with the previous weights, as in Lawson's algorithm for the
    smallest largest error.
    """
    position, weight = error.position, error.weight
    mean = 0.0
    for point in range(POINT_COUNT):
        for t in range(position.shape[1]):
            e = position[point, t]
            mean += np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
    mean = mean / weight.size + 1e-12
    total = 0.0
    for point in range(POINT_COUNT):
        for t in range(position.shape[1]):
            e = position[point, t]
            target = (np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) + 0.3 * mean) / (1.3 * mean)
            weight[point, t] = np.sqrt(target * weight[point, t]) if blend_previous else target
            total += weight[point, t]
    weight *= weight.size / total


@njit(cache=True)
def _count_used_frequencies(q: IntArray) -> int:
    used = 0
    for k in range(q.shape[2]):
        for channel_axis in range(57):
            if q[channel_axis // 3, channel_axis % 3, k] != 0:
                used = k + 1
    return used


@njit(cache=True)
def start_sweep(block: BlockInput, q: IntArray, bit_price: float, extra_frequencies: int = 0) -> Sweep:
    """Return a sweep whose context model contains the levels of all current coefficients.

    A channel that is coded later therefore counts as it was before the sweep.
    """
    used = min(_count_used_frequencies(q) + extra_frequencies, q.shape[2])
    context = create_context_model(block.prior, block.layout, used, block.quantiser.step, block.duration_level)
    for channel in range(19):
        for k in range(used):
            for axis in range(3):
                update_magnitude(context, channel, axis, k, abs(q[channel, axis, k]))
            finish_frequency(context, channel, k)
    return Sweep(block, context, np.zeros((used, 1 + HIDDEN_UNITS), np.int64), bit_price)


@njit(cache=True)
def start_channel(sweep: Sweep, channel: int) -> None:
    """Compute the sums that the axes of a channel share at each frequency."""
    context = sweep.context
    for k in range(context.frequencies):
        finish_frequency(context, channel, k)
    for k in range(context.frequencies):
        compute_shared_sums(context, channel, k)
        sweep.shared_sums[k] = context.shared_sums


@njit(cache=True)
def _sweep_channel(sweep: Sweep, q: IntArray, channel: int, pose: Pose, error: BlockError, slope: AxisSlope) -> None:
    """Optimise the three axes of one channel and keep the errors up to date."""
    context, chain = sweep.context, sweep.block.chain
    start_channel(sweep, channel)
    for axis in range(3):
        if channel == 0:
            scale = chain.inverse_weight[0][axis, axis]
            _root_derivatives(axis, scale, error, slope)
            if _sweep_axis(sweep, q, channel, axis, slope):
                for point in range(POINT_COUNT):
                    for t in range(len(slope.change)):
                        error.position[point, t, axis] += slope.change[t] * scale
        else:
            rotation_axes(chain, channel - 1, axis, pose, slope.axes)
            _error_derivatives(channel - 1, pose.points, error, slope)
            if _sweep_axis(sweep, q, channel, axis, slope):
                _apply_change(channel - 1, pose.points, error, slope)
    finish_channel(context, channel)


@njit(cache=True, nogil=True)
def refine_coefficients(block: BlockInput, q: IntArray, refinement: Refinement) -> Array:
    """Optimise the coefficients `q` (19, 3, K) of a block in place; return the decoded points (23, n, 3).

    With an error bound, sweeps end as soon as no point is above it or it turns out to be unreachable.
    """
    frames = block.quantiser.basis.shape[1]
    pose = create_pose(frames)
    error = BlockError(np.zeros((POINT_COUNT, frames, 3)), np.zeros((18, frames, 3)), np.ones((POINT_COUNT, frames)))
    slope = AxisSlope(np.zeros((frames, 3)), np.zeros(frames), np.zeros(frames), np.zeros(frames))
    for number in range(refinement.max_sweeps):
        compute_pose(block.chain, block.quantiser, q, pose)
        _measure_errors(block, pose, error)
        if refinement.error_bound_m > 0:
            ratio = _max_error(error) / refinement.error_bound_m
            if number >= _MIN_SWEEPS and (ratio <= 1 or ratio > _UNREACHABLE_ERROR_RATIO):
                return pose.points
            _update_weights(error, number >= _MIN_SWEEPS)
        sweep = start_sweep(block, q, refinement.bit_price)
        for channel in range(block.channels):
            _sweep_channel(sweep, q, channel, pose, error, slope)
    compute_pose(block.chain, block.quantiser, q, pose)
    return pose.points
