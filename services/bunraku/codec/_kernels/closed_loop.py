"""First pass of the encoder: closed-loop quantisation from the root outwards.

Each joint is aimed at the true positions of its children from the position where it is decoded, so that errors do not
add up along a limb. The pass is causal and fast; the `live` grade uses it alone.
"""

from __future__ import annotations

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
    CHILD_COUNT,
    CHILDREN,
    PARENT,
    TIP_OF,
    compute_orientation,
    create_pose,
    evaluate_channel,
    place_child_points,
    project_onto_basis,
    reconstruct,
)
from bunraku.codec._kernels.rotation import (
    apply_matrix,
    from_rotation_vector,
    multiply,
    multiply_inverse,
    rotate,
    to_rotation_vector,
)
from bunraku.codec.block_input import BlockInput, KinematicChain
from bunraku.codec.prior import FREQUENCY_CLASS_OF, IntArray
from bunraku.motion.rotation import Array

_AIM_GAIN = 0.85
"""Share of the least-squares correction that is applied; all of it would follow the quantiser's noise."""
_REGULARISATION_M2 = 0.05**2
_BIT_PRICE = 0.2
"""Squared error, in squared steps, that saving one bit is worth."""


@njit(cache=True)
def _quantise_channel(block: BlockInput, context: ContextModel, q: IntArray, channel: int, values: Array) -> None:
    """Quantise the weighted values (n, 3) of one channel for the lowest sum of error and bits."""
    coefficients = project_onto_basis(block.quantiser.basis, values)
    step_size = block.quantiser.step_size
    for k in range(len(coefficients)):
        needs_sums = True
        for axis in range(3):
            ideal = abs(coefficients[k, axis]) / step_size
            nearest, best = int(ideal + 0.5), 0
            if nearest > 0:
                if needs_sums:
                    compute_shared_sums(context, channel, k)
                    needs_sums = False
                scale = predict_scale(context, channel, axis, k)
                lowest_cost = np.inf
                for candidate in (nearest, nearest - 1, 0):
                    error = ideal - reconstruct(candidate)
                    cost = error * error + _BIT_PRICE * coefficient_bits(
                        block.costs, FREQUENCY_CLASS_OF[k], scale, candidate
                    )
                    if cost < lowest_cost:
                        lowest_cost, best = cost, candidate
            q[channel, axis, k] = best if coefficients[k, axis] > 0 else -best
            update_magnitude(context, channel, axis, k, best)
        finish_frequency(context, channel, k)
    finish_channel(context, channel)


@njit(cache=True)
def _solve_symmetric(a: Array, b: Array, out: Array) -> None:
    """Solve a symmetric positive definite system (3, 3) by Cramer's rule."""
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
def _aim_joint(chain: KinematicChain, joint: int, orientation: Array, position_error: Array, aimed: Array) -> None:
    """Turn a joint's true world `orientation` so that its children come closer to their true positions.

    `position_error` is the joint's true position minus its decoded one.
    """
    a, b, arm, correction, q = np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(4)
    for i in range(CHILD_COUNT[joint] + 1):
        if i < CHILD_COUNT[joint]:
            rotate(orientation, chain.offsets[CHILDREN[joint, i]], arm)
        elif TIP_OF[joint] >= 0:
            rotate(orientation, chain.tips[joint], arm)
        else:
            break
        square = arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2]
        for x in range(3):
            for y in range(3):
                a[x, y] -= arm[x] * arm[y]
            a[x, x] += square
        b[0] += arm[1] * position_error[2] - arm[2] * position_error[1]
        b[1] += arm[2] * position_error[0] - arm[0] * position_error[2]
        b[2] += arm[0] * position_error[1] - arm[1] * position_error[0]
    for x in range(3):
        a[x, x] += _REGULARISATION_M2
    _solve_symmetric(a, b, correction)
    for x in range(3):
        correction[x] *= _AIM_GAIN
    from_rotation_vector(correction, q)
    multiply(q, orientation, aimed)


@njit(cache=True, nogil=True)
def quantise_closed_loop(block: BlockInput, q: IntArray) -> Array:
    """Quantise a block into `q` (19, 3, K); return the decoded points (23, n, 3)."""
    chain, quantiser = block.chain, block.quantiser
    frequencies, frames = quantiser.basis.shape
    context = create_context_model(block.prior, block.layout, frequencies, quantiser.step, block.duration_level)
    pose = create_pose(frames)
    orientation, points = pose.orientation, pose.points
    weighted = np.zeros((frames, 3))
    for t in range(frames):
        apply_matrix(chain.weight[0], block.points[0, t], weighted[t])
    _quantise_channel(block, context, q, 0, weighted)
    points[0] = evaluate_channel(chain, quantiser, q, 0)
    aimed, v, previous, position_error = np.zeros(4), np.zeros(3), np.zeros(3), np.zeros(3)
    for joint in range(18):
        parent = PARENT[joint]
        for t in range(frames):
            for x in range(3):
                position_error[x] = block.points[joint, t, x] - points[joint, t, x]
            _aim_joint(chain, joint, block.orientation[joint, t], position_error, aimed)
            if parent >= 0:
                multiply_inverse(orientation[parent, t], aimed, aimed)
            multiply_inverse(chain.reference[joint], aimed, aimed)
            to_rotation_vector(aimed, v)
            angle = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
            if t > 0 and angle > 1e-6:
                # of all equivalent rotation vectors, take the one nearest to the previous frame
                along = (v[0] * previous[0] + v[1] * previous[1] + v[2] * previous[2]) / angle
                turns = np.round((along - angle) / (2 * np.pi)) * 2 * np.pi
                for x in range(3):
                    v[x] += v[x] / angle * turns
            previous[:] = v
            apply_matrix(chain.weight[joint + 1], v, weighted[t])
        if joint + 1 < block.channels:
            _quantise_channel(block, context, q, joint + 1, weighted)
        compute_orientation(chain, joint, evaluate_channel(chain, quantiser, q, joint + 1), pose)
        place_child_points(chain, joint, pose)
    return points
