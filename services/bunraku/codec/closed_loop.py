"""The first pass of the encoder, compiled: channel by channel from the root outwards, each joint aiming at where its
children truly are from where its parent was decoded to be. Causal and quick; alone it is the `live` grade.
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
    CHILD_COUNT,
    CHILDREN,
    PARENT,
    TIP_OF,
    Array,
    KinematicChain,
    apply_matrix,
    compute_orientation,
    evaluate_channel,
    from_rotation_vector,
    multiply,
    multiply_inverse,
    place_child_points,
    project_onto_basis,
    reconstruct,
    rotate,
    to_rotation_vector,
)
from bunraku.codec.prior import FREQUENCY_CLASS_OF, IntArray, Prior

AIM_SHARE = 0.85
"""Share of the least-squares correction that is taken: all of it would chase the quantiser's noise."""
_REGULARISATION_M2 = 0.05**2
_BIT_PRICE = 0.2
"""What a bit costs against a squared error of one step."""


@njit(cache=True)
def _quantise_channel(
    prior: Prior,
    cost_table: Array,
    context: ContextModel,
    q: IntArray,
    channel: int,
    coefficients: Array,
    step_size: float,
    step: int,
    duration_level: int,
) -> None:
    """Quantise `wanted` (K, 3), coefficients of one channel in the quantiser's scale, by error and bits."""
    count = len(coefficients)
    for k in range(count):
        fresh = True
        for axis in range(3):
            ideal = abs(coefficients[k, axis]) / step_size
            nearest, best = int(ideal + 0.5), 0
            if nearest > 0:
                if fresh:
                    compute_shared_sums(prior, context, channel, k, count, step, duration_level)
                    fresh = False
                expected = predict_scale(prior, context, channel, axis, k)
                least = np.inf
                for candidate in (nearest, nearest - 1, 0):
                    off = ideal - reconstruct(candidate)
                    cost = off * off + _BIT_PRICE * coefficient_bits(
                        cost_table, FREQUENCY_CLASS_OF[k], expected, candidate
                    )
                    if cost < least:
                        least, best = cost, candidate
            q[channel, axis, k] = best if coefficients[k, axis] > 0 else -best
            update_magnitude(context, channel, axis, k, best)
        finish_frequency(context, channel, k)
    finish_channel(context, channel, count)


@njit(cache=True)
def _solve_symmetric(a: Array, b: Array, out: Array) -> None:
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
def _aim_joint(chain: KinematicChain, joint: int, orientation: Array, position_error: Array, aimed: Array) -> None:
    """The true world `orientation` of a joint that stands `off` its place, turned so that its children are nearer."""
    a, b, arm, delta, q = np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(4)
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
    _solve_symmetric(a, b, delta)
    for x in range(3):
        delta[x] *= AIM_SHARE
    from_rotation_vector(delta, q)
    multiply(q, orientation, aimed)


@njit(cache=True, nogil=True)
def quantise_closed_loop(
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
) -> Array:
    """Fill `q` (19, 3, K) for a block whose true pose is `true_orientation` (18, n, 4), `true_points` (23, n, 3); K
    rows of cosines `basis` (K, n); quantiser step `size` of index `step`. The decoded points (23, n, 3)."""
    frames = basis.shape[1]
    seen = create_context_model(basis.shape[0])
    orientation, points = np.zeros((18, frames, 4)), np.zeros((23, frames, 3))
    weighted = np.zeros((frames, 3))
    for t in range(frames):
        apply_matrix(chain.weight[0], true_points[0, t], weighted[t])
    _quantise_channel(
        prior, cost_table, seen, q, 0, project_onto_basis(basis, weighted), step_size, step, duration_level
    )
    points[0] = evaluate_channel(q, 0, step_size, chain.inverse_weight[0], basis)
    aimed, v, before, off = np.zeros(4), np.zeros(3), np.zeros(3), np.zeros(3)
    for joint in range(18):
        parent = PARENT[joint]
        for t in range(frames):
            for x in range(3):
                off[x] = true_points[joint, t, x] - points[joint, t, x]
            _aim_joint(chain, joint, true_orientation[joint, t], off, aimed)
            if parent >= 0:
                multiply_inverse(orientation[parent, t], aimed, aimed)
            multiply_inverse(chain.reference[joint], aimed, aimed)
            to_rotation_vector(aimed, v)
            angle = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
            if t > 0 and angle > 1e-6:
                # of all turns that look the same, the one nearest to the frame before
                along = (v[0] * before[0] + v[1] * before[1] + v[2] * before[2]) / angle
                whole = np.round((along - angle) / (2 * np.pi)) * 2 * np.pi
                for x in range(3):
                    v[x] += v[x] / angle * whole
            before[:] = v
            apply_matrix(chain.weight[joint + 1], v, weighted[t])
        _quantise_channel(
            prior, cost_table, seen, q, joint + 1, project_onto_basis(basis, weighted), step_size, step, duration_level
        )
        compute_orientation(
            chain, joint, evaluate_channel(q, joint + 1, step_size, chain.inverse_weight[joint + 1], basis), orientation
        )
        place_child_points(chain, joint, orientation, points)
    return points
