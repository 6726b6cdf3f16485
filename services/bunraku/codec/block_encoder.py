"""The encoder's choices for one block: which step, which passes, until the error is as asked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, partial
from types import ModuleType
from typing import Any, Literal

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.allocation import select_cheapest
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.motion_track import MotionTrack, step_size
from bunraku.codec.prior import IntArray, Prior
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, PARENTS, TIP_JOINTS, Motion, joint_and_tip_positions

MIN_STEP, MAX_STEP = 0, 255
POINT_COUNT = JOINT_COUNT + len(TIP_JOINTS)
"""Joints and tips that an error is told of."""
_MEAN_ERROR_SWEEPS = 5
_ERROR_BOUND_SWEEPS = 8
_LIVE_MIN_ERROR_SHARE = 0.6
"""The live grade is content with a block whose largest error is this share of what it may be."""
_MEAN_ERROR_BIT_PRICE = 0.35
_MEAN_ERROR_BIT_PRICES = 0.28, 0.45
"""Of a bit, in squared steps; a mean error is looked for at the first, then met with those on both its sides."""
_STEP_SEARCH_RADIUS = 6
"""Steps up and down that blocks of one mean error may have."""
_ERROR_BOUND_BIT_PRICE = 0.6


@dataclass(frozen=True)
class EncodedBlock:
    """A block at one `step` index, and its error in mm at each point and frame (23, n)."""

    step: int
    errors_mm: Array
    _encode: Callable[[], bytes]

    @cached_property
    def data(self) -> bytes:
        """The block's bytes, coded when they are first asked for: most tries are never sent."""
        return self._encode()


@cache
def _load_kernels() -> tuple[ModuleType, ModuleType, ModuleType, ModuleType]:
    """The passes load compiled code; programs that encode nothing never wait for it."""

    from bunraku.codec import bit_cost, closed_loop, forward_kinematics, rate_distortion

    return forward_kinematics, bit_cost, closed_loop, rate_distortion


class BlockEncoder:
    """Encodes the blocks of one motion upon its track."""

    def __init__(self, track: MotionTrack, motion: Motion, prior: Prior) -> None:
        self._track = track
        self._prior = prior
        self._root = motion.rotations[:, 0]
        orientation = np.empty((len(PARENTS), motion.frame_count, 4))
        orientation[0] = motion.rotations[:, 0]
        for joint, parent in enumerate(PARENTS[1:], 1):
            orientation[joint] = rotation.multiply(orientation[parent], motion.rotations[:, joint])
        self._orientation = orientation
        self._points = np.ascontiguousarray(
            joint_and_tip_positions(motion.figure, motion.root, motion.rotations).transpose(1, 0, 2)
        )

    @cached_property
    def _cost_table(self) -> Array:
        table: Array = _load_kernels()[1].build_cost_table(self._prior)
        return table

    def _kinematic_chain(self, heading: int) -> Any:
        figure, reference = self._track.figure, self._track.reference_rotations(heading)
        return _load_kernels()[0].KinematicChain(
            figure.offsets, figure.tips, self._track.weights, self._track.inverse_weights, reference
        )

    def encode_block(
        self,
        index: int,
        step: int,
        goal: Literal["first", "mean", "most"],
        error_bound_mm: float = 0.0,
        bit_price: float = _MEAN_ERROR_BIT_PRICE,
    ) -> EncodedBlock:
        """Block `index` at one step: by the first pass alone, or refined for its mean error, a bit at `price` squared
        steps, or until no point is more than `bound` mm off."""
        forward_kinematics, _, closed_loop, rate_distortion = _load_kernels()
        track = self._track
        start, frames = track.first_frame(index), track.frames_in(index)
        part = slice(start, start + frames)
        heading = self._track.nearest_heading(self._root[start + frames // 2])
        body = self._kinematic_chain(heading)
        basis = np.ascontiguousarray(transform.cosine_basis(frames, frames, np.arange(frames, dtype=np.float64)).T)
        size, length = step_size(step, frames), coefficients.duration_level(frames, track.fps)
        truth = np.ascontiguousarray(self._orientation[:, part]), np.ascontiguousarray(self._points[:, part])
        q: IntArray = np.zeros((19, 3, frames), dtype=np.int64)
        given = (self._prior, self._cost_table, body, *truth, basis, size, step, length, q)
        decoded = closed_loop.quantise_closed_loop(*given)
        if goal == "mean":
            decoded = rate_distortion.refine_coefficients(*given, _MEAN_ERROR_SWEEPS, bit_price, 0.0)
        elif goal == "most":
            decoded = rate_distortion.refine_coefficients(
                *given, _ERROR_BOUND_SWEEPS, _ERROR_BOUND_BIT_PRICE, error_bound_mm * 1e-3
            )
        if track.is_still:
            # the joints' references are the pose itself: following the root's error would cost more than it mends
            q[2:] = 0
            decoded = forward_kinematics.compute_points(body, q, size, basis)
        head = BlockHeader(frames, step, heading)
        write = partial(coefficients.encode_coefficients, self._prior, head, q, track.block_frames, track.fps)
        return EncodedBlock(step, np.linalg.norm(decoded - truth[1], axis=-1) * 1e3, write)

    def encode_within_bound(
        self, index: int, error_bound_mm: float, grade: str, initial_step: int | None = None
    ) -> EncodedBlock:
        """Block `index` with no point more than `bound` mm off, at the cheapest step found; the search starts at step
        `near`. Raises ValueError where no step is fine enough."""
        goal: Literal["first", "most"] = "first" if grade == "live" else "most"
        tried: dict[int, EncodedBlock] = {}

        def holds(step: int) -> bool:
            if step not in tried:
                tried[step] = self.encode_block(index, step, goal, error_bound_mm)
            return bool(tried[step].errors_mm.max() <= error_bound_mm * (1 - 1e-6))

        step = (
            initial_step
            if initial_step is not None
            else int(np.clip(16 * np.log2(error_bound_mm * 2e-4 / 2.0**-16), MIN_STEP, MAX_STEP))
        )
        good = step if holds(step) else None
        for _ in range(6 if grade == "best" else 1):
            most = max(float(tried[step].errors_mm.max()), 1e-9)
            if grade == "live" and _LIVE_MIN_ERROR_SHARE * error_bound_mm < most <= error_bound_mm:
                break
            move = int(np.clip(np.round(16 * np.log2(error_bound_mm * 0.97 / most)), -48, 48))
            if good is not None and abs(move) <= 1:
                break
            step = int(np.clip(step + (move or (-1 if good is None else 1)), MIN_STEP, MAX_STEP))
            if step in tried:
                break
            if holds(step):
                good = step if good is None else max(good, step)
        step = min(tried)
        while good is None:
            if step == MIN_STEP:
                raise ValueError(f"block {index} cannot be held to {error_bound_mm} mm at the finest step")
            step = max(step - 4, MIN_STEP)
            good = step if holds(step) else None
        if grade == "best":
            for more in (2, 4, 6):
                if good + more <= MAX_STEP:
                    holds(good + more)
        return min((coded for step, coded in tried.items() if holds(step)), key=lambda coded: len(coded.data))

    def encode_to_mean_error(self, mean_error_mm: float) -> list[EncodedBlock]:
        """All blocks with a mean error over the motion of at most `mean` mm and near it: each at several steps and
        prices, of which those are taken that together have the fewest bytes."""
        blocks, budget = range(self._track.block_count), mean_error_mm * POINT_COUNT * self._track.frames
        tried: dict[int, float] = {}

        def at(step: int) -> float:
            if step not in tried:
                tried[step] = sum(float(self.encode_block(index, step, "mean").errors_mm.sum()) for index in blocks)
            return tried[step]

        low, high = MIN_STEP, MAX_STEP
        step = int(np.clip(16 * np.log2(mean_error_mm * 2e-3 / 2.0**-16), MIN_STEP + 1, MAX_STEP - 1))
        while high - low > 1:
            error = at(step)
            if error <= budget:
                low = step
            else:
                high = step
            guess = step + int(np.clip(np.round(19 * np.log2(budget / max(error, 1e-9))), -64, 64))
            step = min(max(guess, low + 1), high - 1)
        if at(low) > budget:
            raise ValueError(f"the motion cannot be held to a mean error of {mean_error_mm} mm")
        steps = range(max(low - _STEP_SEARCH_RADIUS, MIN_STEP), min(low + _STEP_SEARCH_RADIUS, MAX_STEP) + 1, 2)
        tries = [(step, price) for step in steps for price in _MEAN_ERROR_BIT_PRICES]
        coded = [[self.encode_block(index, step, "mean", bit_price=price) for index in blocks] for step, price in tries]
        sizes = np.array([[float(len(block.data)) for block in row] for row in coded])
        errors = np.array([[float(block.errors_mm.sum()) for block in row] for row in coded])
        return [coded[row][index] for index, row in enumerate(select_cheapest(sizes, errors, budget))]
