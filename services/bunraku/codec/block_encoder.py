"""Encoder of one motion block: search for the quantiser step that meets an error with the fewest bytes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Literal

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.allocation import select_cheapest
from bunraku.codec.block_input import BlockInput, KinematicChain, Quantiser, Refinement
from bunraku.codec.channel_layout import MOTION_LAYOUT
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.motion_track import MotionTrack, step_size
from bunraku.codec.prior import IntArray, Prior
from bunraku.codec.step_search import MAX_STEP, MIN_STEP, StepSearch
from bunraku.kernels import load_kernels
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import CHANNEL_COUNT, JOINT_COUNT, PARENTS, TIP_JOINTS, Motion, joint_and_tip_positions

EncodingGrade = Literal["live", "best"]
"""Effort of the encoder: `live` makes a single pass and accepts a step quickly, `best` refines and searches."""

POINT_COUNT = JOINT_COUNT + len(TIP_JOINTS)
"""Joints and tips at which errors are measured."""
MEAN_ERROR_REFINEMENT = Refinement(max_sweeps=5, bit_price=0.35)
"""Second pass for a low mean error."""

_MEAN_ERROR_BIT_PRICES = 0.28, 0.45
"""Bit prices of the candidates for a mean error: on both sides of the price of the step search."""
_STEP_SEARCH_RADIUS = 6
"""Range of step indices, up and down, among the blocks of one mean error."""
_ERROR_BOUND_SWEEPS = 7
_ERROR_BOUND_BIT_PRICE = 0.6
_STILL_TOLERANCE = 2.0**-13
"""Difference of quaternions up to which joints have their references: that of two still frames, and of rounding."""
_STILL_ERROR_MM = 0.25
"""Largest displacement of a point up to which joints have their references, without an error bound."""
_STILL_BOUND_SHARE = 0.5
"""Share of an error bound that the displacement may have: the root needs the rest."""
_STILL_CHANNELS = 2
"""Channels of a body whose joints stand still: position and rotation of the root."""


def error_bound_refinement(error_bound_mm: float) -> Refinement:
    """Return the second pass that lowers the largest error of a block to a bound."""
    return Refinement(_ERROR_BOUND_SWEEPS, _ERROR_BOUND_BIT_PRICE, error_bound_mm * 1e-3)


@dataclass(frozen=True)
class EncodedBlock:
    """A block at one step index, and its errors in mm at each point and frame (23, n)."""

    step: int
    errors_mm: Array
    _encode: Callable[[], bytes]

    @cached_property
    def data(self) -> bytes:
        """Bytes of the block. Encoded at the first access, because most candidates are discarded."""
        return self._encode()


class BlockEncoder:
    """Encoder of the blocks of one motion."""

    def __init__(self, track: MotionTrack, motion: Motion, prior: Prior) -> None:
        self._track = track
        self._prior = prior
        self._root = motion.rotations[:, 0]
        orientation = np.empty((len(PARENTS), motion.frame_count, 4))
        orientation[0] = motion.rotations[:, 0]
        for joint, parent in enumerate(PARENTS[1:], 1):
            orientation[joint] = rotation.multiply(orientation[parent], motion.rotations[:, joint])
        self._orientation = orientation
        # a live performer moves on the track of a motion at rest
        points = joint_and_tip_positions(motion.figure, motion.root, motion.rotations)
        self._still_error_mm = _measure_still_error(track, motion, points) if track.is_still else np.inf
        self._points = np.ascontiguousarray(points.transpose(1, 0, 2))

    @cached_property
    def _costs(self) -> Array:
        table: Array = load_kernels("codec").build_cost_table(self._prior)
        return table

    def _block_input(self, index: int, step: int, heading: int, channels: int) -> BlockInput:
        track = self._track
        start, frames = track.first_frame(index), track.frames_in(index)
        part = slice(start, start + frames)
        basis = np.ascontiguousarray(transform.cosine_basis(frames, frames, np.arange(frames, dtype=np.float64)).T)
        return BlockInput(
            self._prior,
            MOTION_LAYOUT,
            self._costs,
            KinematicChain(
                track.figure.offsets,
                track.figure.tips,
                track.weights,
                track.inverse_weights,
                track.reference_rotations(heading),
            ),
            Quantiser(basis, step, step_size(step, frames)),
            coefficients.duration_level(frames, track.fps),
            channels,
            np.ascontiguousarray(self._orientation[:, part]),
            np.ascontiguousarray(self._points[:, part]),
        )

    def encode_block(
        self, index: int, step: int, refinement: Refinement | None = None, still_error_mm: float = _STILL_ERROR_MM
    ) -> EncodedBlock:
        """Encode block `index` at one step index, in a single pass or with a second pass that refines it.

        Joints that stand still have no coefficients if their references displace no point by more than
        `still_error_mm`: joints that correct the root's error cost more than they gain.
        """
        kernels = load_kernels("codec")
        track = self._track
        start, frames = track.first_frame(index), track.frames_in(index)
        heading = track.nearest_heading(self._root[start + frames // 2])
        channels = _STILL_CHANNELS if self._still_error_mm <= still_error_mm else CHANNEL_COUNT
        block = self._block_input(index, step, heading, channels)
        q: IntArray = np.zeros((19, 3, frames), dtype=np.int64)
        decoded = kernels.quantise_closed_loop(block, q)
        if refinement is not None:
            if refinement.error_bound_m > 0:
                decoded = kernels.refine_within_bound(block, q, refinement)
            else:
                decoded = kernels.refine_coefficients(block, q, refinement)
        header = BlockHeader(frames, step, heading)
        encode = partial(coefficients.encode_coefficients, self._prior, header, q, track.block_frames, track.fps)
        return EncodedBlock(step, np.linalg.norm(decoded - block.points, axis=-1) * 1e3, encode)

    def encode_within_bound(
        self, index: int, error_bound_mm: float, grade: EncodingGrade, initial_step: int | None = None
    ) -> EncodedBlock:
        """Encode block `index` with no point more than `error_bound_mm` off, at the cheapest step found.

        The search starts at `initial_step`, if given. The `live` grade refines only a block that a single pass does not
        bring within the bound at any step. Raises ValueError if the finest step does not meet the bound.
        """
        step = (
            initial_step
            if initial_step is not None
            else int(np.clip(16 * np.log2(error_bound_mm * 2e-4 / 2.0**-16), MIN_STEP, MAX_STEP))
        )
        encode = partial(self.encode_block, index, still_error_mm=_STILL_BOUND_SHARE * error_bound_mm)
        found = StepSearch(encode, error_bound_mm).find_valid(step) if grade == "live" else None
        if found is None:
            refined = partial(encode, refinement=error_bound_refinement(error_bound_mm))
            found = StepSearch(refined, error_bound_mm).find_cheapest(step)
        if found is None:
            raise ValueError(f"Block {index} cannot be encoded within {error_bound_mm} mm, even at the finest step.")
        return found

    def encode_to_mean_error(self, mean_error_mm: float) -> list[EncodedBlock]:
        """Encode all blocks with a mean error over the motion of at most, and close to, `mean_error_mm`.

        Each block is encoded at several steps and bit prices; of these, the combination with the fewest bytes is taken.
        Raises ValueError if the finest step does not reach the mean error.
        """
        blocks, budget = range(self._track.block_count), mean_error_mm * POINT_COUNT * self._track.frames
        step = self._coarsest_step_within(budget, int(16 * np.log2(mean_error_mm * 2e-3 / 2.0**-16)))
        if step is None:
            raise ValueError(
                f"The motion cannot be encoded with a mean error of {mean_error_mm} mm, even at the finest step."
            )
        steps = range(max(step - _STEP_SEARCH_RADIUS, MIN_STEP), min(step + _STEP_SEARCH_RADIUS, MAX_STEP) + 1, 2)
        settings = [
            (step, MEAN_ERROR_REFINEMENT._replace(bit_price=price))
            for step in steps
            for price in _MEAN_ERROR_BIT_PRICES
        ]
        candidates = [[self.encode_block(index, step, refinement) for index in blocks] for step, refinement in settings]
        sizes = np.array([[float(len(block.data)) for block in row] for row in candidates])
        errors = np.array([[float(block.errors_mm.sum()) for block in row] for row in candidates])
        return [candidates[row][index] for index, row in enumerate(select_cheapest(sizes, errors, budget))]

    def _coarsest_step_within(self, error_budget: float, initial_step: int) -> int | None:
        """Return the coarsest step found at which the errors of all points and frames sum up to at most the budget."""
        known: dict[int, float] = {}

        def total_error(step: int) -> float:
            if step not in known:
                blocks = (
                    self.encode_block(index, step, MEAN_ERROR_REFINEMENT) for index in range(self._track.block_count)
                )
                known[step] = sum(float(block.errors_mm.sum()) for block in blocks)
            return known[step]

        low, high = MIN_STEP, MAX_STEP
        step = int(np.clip(initial_step, MIN_STEP + 1, MAX_STEP - 1))
        while high - low > 1:
            error = total_error(step)
            if error <= error_budget:
                low = step
            else:
                high = step
            guess = step + int(np.clip(np.round(19 * np.log2(error_budget / max(error, 1e-9))), -64, 64))
            step = min(max(guess, low + 1), high - 1)
        return low if total_error(low) <= error_budget else None


def _measure_still_error(track: MotionTrack, motion: Motion, points: Array) -> float:
    """Return how far the references displace a point of a motion (n, 23, 3), in mm; infinity if joints turn."""
    references = np.broadcast_to(track.reference_rotations(0), motion.rotations.shape).copy()
    if not np.allclose(motion.rotations[:, 1:], references[:, 1:], atol=_STILL_TOLERANCE):
        return np.inf
    references[:, 0] = motion.rotations[:, 0]
    still = joint_and_tip_positions(motion.figure, motion.root, references)
    return float(np.linalg.norm(still - points, axis=-1).max() * 1e3)
