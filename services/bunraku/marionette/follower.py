"""Controlled limb on its way to a target, at a bounded acceleration."""

from __future__ import annotations

from math import inf

from bunraku.marionette.constants import MAX_TARGET_SPEED
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.marionette.solver.vector import ZERO, Vector


class Follower:
    """Position and velocity of a hand (arm lengths) or a thigh (radians, the first of three numbers)."""

    def __init__(self, position: Vector, velocity: Vector = ZERO, solver: LimbSolver = PYTHON_SOLVER) -> None:
        self.solver = solver
        self.position = position
        self.velocity = velocity
        self._previous_target: Vector | None = None
        self._previous_frame_velocity: Vector | None = None

    def step(
        self,
        target: Vector,
        seconds: float,
        acceleration: float,
        min_distance: float = 0.0,
        max_distance: float = inf,
        frame_velocity: Vector | None = None,
    ) -> Vector:
        """Move towards `target` for `seconds` and return the new position.

        `acceleration` (per second squared) bounds the change of velocity. With `frame_velocity`, the velocity of a
        moving frame of reference (the limb in the stored motion), it bounds the change relative to that frame, so that
        the time of the return does not depend on the motion. The distance from the origin stays within
        `min_distance` and `max_distance`; a path past the origin keeps `SHOULDER_CLEARANCE` where it can.
        """
        if seconds <= 0.0:
            return self.position
        if frame_velocity is not None:
            target_velocity, previous = frame_velocity, self._previous_frame_velocity or frame_velocity
        else:
            moved = vector.scale(vector.subtract(target, self._previous_target or target), 1.0 / seconds)
            target_velocity = moved if vector.length(moved) <= MAX_TARGET_SPEED else ZERO
            previous = ZERO
        self._previous_target, self._previous_frame_velocity = target, frame_velocity
        # in a moving frame all velocities are relative to it
        frame = target_velocity if frame_velocity is not None else ZERO
        self.position, self.velocity = self.solver.advance(
            self.position,
            self.velocity,
            target,
            target_velocity,
            previous,
            frame,
            seconds,
            acceleration,
            min_distance,
            max_distance,
        )
        return self.position

    def move_to(self, position: Vector, seconds: float) -> None:
        """Move to a position that was computed otherwise, in `seconds`; the next step begins with that velocity."""
        if seconds > 0.0:
            self.velocity = vector.scale(vector.subtract(position, self.position), 1.0 / seconds)
        self.position = position
        self._previous_target = self._previous_frame_velocity = None
