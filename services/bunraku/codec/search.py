"""The encoder's choices for one block: which step, which passes, until the error is as asked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, partial
from types import ModuleType
from typing import Any, Literal

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.allocation import cheapest
from bunraku.codec.coefficients import Head
from bunraku.codec.prior import Integers, Prior
from bunraku.codec.track import MotionTrack, step_size
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, PARENTS, TIPS, Motion, points

FINEST, COARSEST = 0, 255
POINTS = JOINT_COUNT + len(TIPS)
"""Joints and tips that an error is told of."""
_SWEEPS_OF_MEAN = 5
_SWEEPS_OF_MOST = 8
_SLACK = 0.6
"""The live grade is content with a block whose largest error is this share of what it may be."""
_PRICE_OF_MEAN = 0.35
_PRICES_OF_MEAN = 0.28, 0.45
"""Of a bit, in squared steps; a mean error is looked for at the first, then met with those on both its sides."""
_AROUND = 6
"""Steps up and down that blocks of one mean error may have."""
_PRICE_OF_MOST = 0.6


@dataclass(frozen=True)
class Coded:
    """A block at one `step` index, and its error in mm at each point and frame (23, n)."""

    step: int
    error: Array
    _write: Callable[[], bytes]

    @cached_property
    def data(self) -> bytes:
        """The block's bytes, coded when they are first asked for: most tries are never sent."""
        return self._write()


@cache
def _compiled() -> tuple[ModuleType, ModuleType, ModuleType, ModuleType]:
    """The passes load compiled code; programs that encode nothing never wait for it."""
    from bunraku.codec import bodies, costs, feedback, refine

    return bodies, costs, feedback, refine


class BlockEncoder:
    """Encodes the blocks of one motion upon its track."""

    def __init__(self, track: MotionTrack, motion: Motion, prior: Prior) -> None:
        self._track = track
        self._prior = prior
        self._root = motion.rotations[:, 0]
        orientation = np.empty((len(PARENTS), motion.frames, 4))
        orientation[0] = motion.rotations[:, 0]
        for joint, parent in enumerate(PARENTS[1:], 1):
            orientation[joint] = rotation.multiply(orientation[parent], motion.rotations[:, joint])
        self._orientation = orientation
        self._points = np.ascontiguousarray(points(motion.figure, motion.root, motion.rotations).transpose(1, 0, 2))

    @cached_property
    def _costs(self) -> Array:
        table: Array = _compiled()[1].cost_table(self._prior)
        return table

    def _body(self, heading: int) -> Any:
        figure, reference = self._track.figure, self._track.reference_rotations(heading)
        return _compiled()[0].Body(figure.offsets, figure.tips, self._track.weights, self._track.unweights, reference)

    def block(
        self,
        index: int,
        step: int,
        goal: Literal["first", "mean", "most"],
        bound: float = 0.0,
        price: float = _PRICE_OF_MEAN,
    ) -> Coded:
        """Block `index` at one step: by the first pass alone, or refined for its mean error, a bit at `price` squared
        steps, or until no point is more than `bound` mm off."""
        bodies, _, feedback, refine = _compiled()
        track = self._track
        start, frames = track.first_frame(index), track.frames_in(index)
        part = slice(start, start + frames)
        heading = self._track.heading(self._root[start + frames // 2])
        body = self._body(heading)
        basis = np.ascontiguousarray(transform.basis(frames, frames, np.arange(frames, dtype=np.float64)).T)
        size, length = step_size(step, frames), coefficients.length_level(frames, track.fps)
        truth = np.ascontiguousarray(self._orientation[:, part]), np.ascontiguousarray(self._points[:, part])
        q: Integers = np.zeros((19, 3, frames), dtype=np.int64)
        given = (self._prior, self._costs, body, *truth, basis, size, step, length, q)
        decoded = feedback.first_pass(*given)
        if goal == "mean":
            decoded = refine.refine(*given, _SWEEPS_OF_MEAN, price, 0.0)
        elif goal == "most":
            decoded = refine.refine(*given, _SWEEPS_OF_MOST, _PRICE_OF_MOST, bound * 1e-3)
        if track.still:
            # the joints' references are the pose itself: following the root's error would cost more than it mends
            q[2:] = 0
            decoded = bodies.points(body, q, size, basis)
        head = Head(frames, step, heading)
        write = partial(coefficients.encode, self._prior, head, q, track.block_frames, track.fps)
        return Coded(step, np.linalg.norm(decoded - truth[1], axis=-1) * 1e3, write)

    def bounded(self, index: int, bound: float, grade: str, near: int | None = None) -> Coded:
        """Block `index` with no point more than `bound` mm off, at the cheapest step found; the search starts at step
        `near`. Raises ValueError where no step is fine enough."""
        goal: Literal["first", "most"] = "first" if grade == "live" else "most"
        tried: dict[int, Coded] = {}

        def holds(step: int) -> bool:
            if step not in tried:
                tried[step] = self.block(index, step, goal, bound)
            return bool(tried[step].error.max() <= bound * (1 - 1e-6))

        step = near if near is not None else int(np.clip(16 * np.log2(bound * 2e-4 / 2.0**-16), FINEST, COARSEST))
        good = step if holds(step) else None
        for _ in range(6 if grade == "best" else 1):
            most = max(float(tried[step].error.max()), 1e-9)
            if grade == "live" and _SLACK * bound < most <= bound:
                break
            move = int(np.clip(np.round(16 * np.log2(bound * 0.97 / most)), -48, 48))
            if good is not None and abs(move) <= 1:
                break
            step = int(np.clip(step + (move or (-1 if good is None else 1)), FINEST, COARSEST))
            if step in tried:
                break
            if holds(step):
                good = step if good is None else max(good, step)
        step = min(tried)
        while good is None:
            if step == FINEST:
                raise ValueError(f"block {index} cannot be held to {bound} mm at the finest step")
            step = max(step - 4, FINEST)
            good = step if holds(step) else None
        if grade == "best":
            for more in (2, 4, 6):
                if good + more <= COARSEST:
                    holds(good + more)
        return min((coded for step, coded in tried.items() if holds(step)), key=lambda coded: len(coded.data))

    def averaged(self, mean: float) -> list[Coded]:
        """All blocks with a mean error over the motion of at most `mean` mm and near it: each at several steps and
        prices, of which those are taken that together have the fewest bytes."""
        blocks, budget = range(self._track.blocks), mean * POINTS * self._track.frames
        tried: dict[int, float] = {}

        def at(step: int) -> float:
            if step not in tried:
                tried[step] = sum(float(self.block(index, step, "mean").error.sum()) for index in blocks)
            return tried[step]

        low, high = FINEST, COARSEST
        step = int(np.clip(16 * np.log2(mean * 2e-3 / 2.0**-16), FINEST + 1, COARSEST - 1))
        while high - low > 1:
            error = at(step)
            if error <= budget:
                low = step
            else:
                high = step
            guess = step + int(np.clip(np.round(19 * np.log2(budget / max(error, 1e-9))), -64, 64))
            step = min(max(guess, low + 1), high - 1)
        if at(low) > budget:
            raise ValueError(f"the motion cannot be held to a mean error of {mean} mm")
        steps = range(max(low - _AROUND, FINEST), min(low + _AROUND, COARSEST) + 1, 2)
        tries = [(step, price) for step in steps for price in _PRICES_OF_MEAN]
        coded = [[self.block(index, step, "mean", price=price) for index in blocks] for step, price in tries]
        sizes = np.array([[float(len(block.data)) for block in row] for row in coded])
        errors = np.array([[float(block.error.sum()) for block in row] for row in coded])
        return [coded[row][index] for index, row in enumerate(cheapest(sizes, errors, budget))]
