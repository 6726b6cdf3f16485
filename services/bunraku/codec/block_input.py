"""Input of the encoder's kernels: named tuples, which compiled code takes as they are."""

from __future__ import annotations

from typing import NamedTuple

from bunraku.codec.channel_layout import ChannelLayout
from bunraku.codec.prior import Prior
from bunraku.motion.rotation import Array


class KinematicChain(NamedTuple):
    """The skeleton of a block: what turns channel values into positions.

    `offsets` and `tips` (18, 3) are bones in metres. `weight` and `inverse_weight` (19, 3, 3) convert the values of a
    channel to the scale of the quantiser and back. Rotations of a joint are relative to its `reference` (18, 4).
    """

    offsets: Array
    tips: Array
    weight: Array
    inverse_weight: Array
    reference: Array


class Quantiser(NamedTuple):
    """Transform and step size of a block: cosines `basis` (K, n), step index, and step size in metres."""

    basis: Array
    step: int
    step_size: float


class BlockInput(NamedTuple):
    """One block to encode, the same for all passes of the encoder.

    `costs` is `build_cost_table(prior)`, `duration_level` a feature of the context model. The coefficients of channels
    from number `channels` on are zero. The source motion is given in the world frame: `orientation` (18, n, 4) of the
    joints, and `points` (23, n, 3), joints first, then tips.
    """

    prior: Prior
    layout: ChannelLayout
    costs: Array
    chain: KinematicChain
    quantiser: Quantiser
    duration_level: int
    channels: int
    orientation: Array
    points: Array


class Refinement(NamedTuple):
    """Settings of the second pass.

    A bit costs as much as a squared error of `bit_price` squared steps. If `error_bound_m` is above zero, the pass
    lowers the largest error until it is within that bound (metres), otherwise the sum of squared errors.
    """

    max_sweeps: int
    bit_price: float
    error_bound_m: float = 0.0
