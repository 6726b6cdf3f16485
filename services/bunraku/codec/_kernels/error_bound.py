"""Third pass of the encoder for an error bound: repair the points above it, and spend the slack of all others.

The second pass minimises weighted squares, so a few points decide whether a step meets the bound. This pass minimises
bits and a penalty that is flat for small errors and steep above the bound. Each change of a coefficient is evaluated at
all points and frames that it moves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bunraku.codec._kernels.bit_cost import coefficient_bits
from bunraku.codec._kernels.context_model import (
    finish_channel,
    finish_frequency,
    predict_scale,
    update_magnitude,
)
from bunraku.codec._kernels.forward_kinematics import (
    MOVED_POINT_COUNT,
    MOVED_POINTS,
    POINT_COUNT,
    Pose,
    compute_pose,
    create_pose,
    reconstruct,
)
from bunraku.codec._kernels.rate_distortion import (
    Sweep,
    refine_coefficients,
    rotation_axes,
    start_channel,
    start_sweep,
)
from bunraku.codec.block_input import BlockInput, Refinement
from bunraku.codec.prior import FREQUENCY_CLASS_OF, IntArray
from bunraku.motion.rotation import Array

_FIRST_SWEEPS = 2
"""Sweeps of the second pass."""
_INITIAL_BITS_PER_PENALTY = 2.0
"""Bits that a penalty of 1 is worth in the first sweep.

It doubles after each sweep that leaves the bound exceeded, and halves after each that meets it.
"""
_SLACK_PENALTY = 0.25
"""Penalty of a point at the bound. Below it, the penalty is that times the sixth power of the error."""
_EXCESS_PENALTY = 5.0
"""Further penalty by unit of squared error above the squared bound."""
_BOUND_SHARE = 0.999
"""Share of the bound that is aimed at, because changes are linearised."""
_VALID_RATIO = (1 - 1e-6) / _BOUND_SHARE
_UNREACHABLE_ERROR_RATIO = 3.0
"""Largest error over the bound above which the bound is given up."""
_MIN_BITS_OF_ONE = 1.0
"""Bits that a coefficient is taken to add if it is not zero any more, before its scale is predicted."""
_EXTRA_FREQUENCIES = 3
"""Frequencies above the block's last that a repair may use."""


class _Errors(NamedTuple):
    """Errors (23, 3, n) of the points, in units of the bound, and displacements (23, 3, n) by unit of one value.

    Displacements are those of the points `moved` (m), in their order; `slope` (n) and `penalty` (m) are of the errors.
    """

    position: Array
    displacement: Array
    slope: Array
    penalty: Array


@njit(cache=True)
def _update_errors(block: BlockInput, pose: Pose, bound_m: float, errors: _Errors) -> float:
    """Set the errors to those of a pose; return the largest, in units of the bound."""
    largest = 0.0
    for point in range(POINT_COUNT):
        for t in range(pose.points.shape[1]):
            square = 0.0
            for x in range(3):
                e = (pose.points[point, t, x] - block.points[point, t, x]) / bound_m
                errors.position[point, x, t] = e
                square += e * e
            largest = max(largest, square)
    return np.sqrt(largest)  # type: ignore[no-any-return]


@njit(cache=True)
def _update_displacements(pose: Pose, joint: int, axes: Array, bound_m: float, errors: _Errors) -> None:
    """Set the displacements to those of the points that a joint moves, for world rotations `axes` (n, 3)."""
    u = errors.displacement
    for i in range(MOVED_POINT_COUNT[joint]):
        point = MOVED_POINTS[joint, i]
        for t in range(len(axes)):
            d0, d1, d2 = axes[t, 0] / bound_m, axes[t, 1] / bound_m, axes[t, 2] / bound_m
            a = pose.points[point, t, 0] - pose.points[joint, t, 0]
            b = pose.points[point, t, 1] - pose.points[joint, t, 1]
            c = pose.points[point, t, 2] - pose.points[joint, t, 2]
            u[i, 0, t], u[i, 1, t], u[i, 2, t] = d1 * c - d2 * b, d2 * a - d0 * c, d0 * b - d1 * a


@njit(cache=True, fastmath=True)
def _update_slopes(moved: IntArray, errors: _Errors) -> None:
    """Compute the penalty of each point, and the derivative of their sum by the value at each frame."""
    slope = errors.slope
    slope[:] = 0
    for i in range(len(moved)):
        e, u = errors.position[moved[i]], errors.displacement[i]
        total = 0.0
        for t in range(len(slope)):
            square = e[0, t] * e[0, t] + e[1, t] * e[1, t] + e[2, t] * e[2, t]
            excess = 1.0 if square > 1 else 0.0
            total += _SLACK_PENALTY * square * square * square + _EXCESS_PENALTY * excess * (square - 1)
            along = e[0, t] * u[0, t] + e[1, t] * u[1, t] + e[2, t] * u[2, t]
            slope[t] += 2 * along * (3 * _SLACK_PENALTY * square * square + _EXCESS_PENALTY * excess)
        errors.penalty[i] = total


@njit(cache=True, fastmath=True)
def _penalty_added(moved: IntArray, errors: _Errors, cosines: Array, delta: float, limit: float) -> float:
    """Return the rise of the penalty if the value moves by `delta * cosines` (n), or a number above `limit`."""
    added, removable = 0.0, 0.0
    for i in range(len(moved)):
        removable += errors.penalty[i]
    # the last points move most
    for i in range(len(moved) - 1, -1, -1):
        e, u = errors.position[moved[i]], errors.displacement[i]
        total = 0.0
        for t in range(len(cosines)):
            move = delta * cosines[t]
            x, y, z = e[0, t] + move * u[0, t], e[1, t] + move * u[1, t], e[2, t] + move * u[2, t]
            square = x * x + y * y + z * z
            excess = square - 1 if square > 1 else 0.0
            total += _SLACK_PENALTY * square * square * square + _EXCESS_PENALTY * excess
        added += total - errors.penalty[i]
        removable -= errors.penalty[i]
        if added - removable > limit:
            break
    return added


@njit(cache=True)
def _sweep_axis(
    sweep: Sweep, q: IntArray, channel: int, axis: int, moved: IntArray, errors: _Errors, bits_per_penalty: float
) -> float:
    """Change the coefficients of one axis where that lowers bits and penalty; return the bits added."""
    context, quantiser, costs = sweep.context, sweep.block.quantiser, sweep.block.costs
    added_bits = 0.0
    _update_slopes(moved, errors)
    for k in range(context.frequencies):
        cosines, current = quantiser.basis[k], q[channel, axis, k]
        gradient = 0.0
        for t in range(len(cosines)):
            gradient += cosines[t] * errors.slope[t]
        value, current_bits, scale, needs_scale = reconstruct(current), 0.0, 0, True
        best, lowest_cost, best_bits = current, -1e-9, 0.0
        sign = 1 if current > 0 or (current == 0 and gradient < 0) else -1
        for option in range(3):
            magnitude = abs(current) + 1 if option == 0 else abs(current) - 1 if option == 1 else 0
            if magnitude < 0 or (option == 2 and abs(current) < 2):
                continue
            delta = (reconstruct(sign * magnitude) - value) * quantiser.step_size
            # the penalty is convex, so that its tangent is a lower limit
            if option == 0 and delta * gradient >= 0:
                continue
            if current == 0 and -delta * gradient * bits_per_penalty < _MIN_BITS_OF_ONE:
                continue
            if needs_scale:
                context.shared_sums[:] = sweep.shared_sums[k]
                scale = predict_scale(context, channel, axis, k)
                current_bits = coefficient_bits(costs, FREQUENCY_CLASS_OF[k], scale, abs(current))
                needs_scale = False
            bits = coefficient_bits(costs, FREQUENCY_CLASS_OF[k], scale, magnitude) - current_bits
            if bits / bits_per_penalty + delta * gradient >= lowest_cost:
                continue
            limit = lowest_cost - bits / bits_per_penalty
            cost = bits / bits_per_penalty + _penalty_added(moved, errors, cosines, delta, limit)
            if cost < lowest_cost:
                best, lowest_cost, best_bits = sign * magnitude, cost, bits
        if best != current:
            added_bits += best_bits
            delta = (reconstruct(best) - value) * quantiser.step_size
            q[channel, axis, k] = best
            update_magnitude(context, channel, axis, k, abs(best))
            finish_frequency(context, channel, k)
            for i in range(len(moved)):
                e, u = errors.position[moved[i]], errors.displacement[i]
                for x in range(3):
                    for t in range(len(cosines)):
                        e[x, t] += delta * cosines[t] * u[x, t]
            _update_slopes(moved, errors)
    return added_bits


@njit(cache=True)
def _sweep_block(
    sweep: Sweep, q: IntArray, pose: Pose, bound_m: float, errors: _Errors, bits_per_penalty: float
) -> float:
    """Change the coefficients of all channels where that lowers bits and penalty; return the bits added."""
    context, chain = sweep.context, sweep.block.chain
    axes, every_point = np.zeros((pose.points.shape[1], 3)), np.arange(POINT_COUNT)
    added_bits = 0.0
    for channel in range(sweep.block.channels):
        start_channel(sweep, channel)
        for axis in range(3):
            if channel == 0:
                moved = every_point
                errors.displacement[:] = 0
                errors.displacement[:, axis] = chain.inverse_weight[0][axis, axis] / bound_m
            else:
                moved = MOVED_POINTS[channel - 1, : MOVED_POINT_COUNT[channel - 1]]
                rotation_axes(chain, channel - 1, axis, pose, axes)
                _update_displacements(pose, channel - 1, axes, bound_m, errors)
            added_bits += _sweep_axis(sweep, q, channel, axis, moved, errors, bits_per_penalty)
        finish_channel(context, channel)
    return added_bits


@njit(cache=True, nogil=True)
def refine_within_bound(block: BlockInput, q: IntArray, refinement: Refinement) -> Array:
    """Optimise the coefficients `q` (19, 3, K) of a block for an error bound; return the decoded points (23, n, 3).

    The second pass comes first. Of the sweeps that meet the bound, the one with the fewest bits counts. If the step is
    too coarse, none does, and the result exceeds the bound.
    """
    points = refine_coefficients(block, q, Refinement(_FIRST_SWEEPS, refinement.bit_price, refinement.error_bound_m))
    frames = block.quantiser.basis.shape[1]
    pose = create_pose(frames)
    bound_m = refinement.error_bound_m * _BOUND_SHARE
    shape = (POINT_COUNT, 3, frames)
    errors = _Errors(np.zeros(shape), np.zeros(shape), np.zeros(frames), np.zeros(POINT_COUNT))
    bits, fewest_bits, bits_per_penalty = 0.0, np.inf, _INITIAL_BITS_PER_PENALTY
    valid, valid_points = q, points
    for number in range(refinement.max_sweeps + 1):
        compute_pose(block.chain, block.quantiser, q, pose)
        ratio = _update_errors(block, pose, bound_m, errors)
        if ratio <= _VALID_RATIO and bits < fewest_bits:
            fewest_bits, valid, valid_points = bits, q.copy(), pose.points.copy()
        if number == refinement.max_sweeps or ratio > _UNREACHABLE_ERROR_RATIO:
            break
        if number > 0:
            bits_per_penalty *= 2.0 if ratio > _VALID_RATIO else 0.5
        sweep = start_sweep(block, q, refinement.bit_price, _EXTRA_FREQUENCIES)
        bits += _sweep_block(sweep, q, pose, bound_m, errors, bits_per_penalty)
    if fewest_bits < np.inf:
        q[:] = valid
        return valid_points
    return pose.points
