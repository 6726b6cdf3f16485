"""Elbow of one arm, moved from frame to frame."""

from __future__ import annotations

from bunraku.marionette.arm import Arm
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.elbow_step import ArmConfiguration, ElbowState
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.marionette.solver.shoulder import ShoulderLimit
from bunraku.marionette.solver.vector import Vector


class Elbow:
    """State of one arm's elbow, in the shoulder's frame so that a turning body carries it."""

    def __init__(self, arm: Arm, shoulder: ShoulderLimit, solver: LimbSolver = PYTHON_SOLVER) -> None:
        self.solver = solver
        self._arm = arm
        self._shoulder = shoulder
        self._state: ElbowState | None = None

    def reset(self) -> None:
        """Forget the state; `begin` must be called before the next step."""
        self._state = None

    @property
    def has_begun(self) -> bool:
        """True if `begin` was called since the last reset."""
        return self._state is not None

    def begin(self, direction: Vector, normal: Vector, lift: float) -> None:
        """Start with the tip in the unit `direction` and the upper arm `lift` radians off the chord.

        The normal of the arm's plane is the part of `normal` perpendicular to the direction.
        """
        square = vector.unit(vector.reject_from(normal, direction), vector.any_perpendicular(direction))
        self._state = (direction, square, lift, (0.0, 0.0, 0.0))

    def step(self, direction: Vector, reach: float, up: Vector, seconds: float) -> ArmConfiguration:
        """Return the arm with its tip in the unit `direction` at `reach` arm lengths, `seconds` after the last step.

        `up` is the world's up, a unit vector in the same frame. Raises RuntimeError before `begin`.
        """
        configuration, self._state = self._advance(direction, reach, up, seconds)
        return configuration

    def preview(self, direction: Vector, reach: float, up: Vector, seconds: float) -> ArmConfiguration:
        """Return what `step` would return, without effect."""
        return self._advance(direction, reach, up, seconds)[0]

    def _advance(
        self, direction: Vector, reach: float, up: Vector, seconds: float
    ) -> tuple[ArmConfiguration, ElbowState]:
        if self._state is None:
            raise RuntimeError("step() needs a state: call begin() first")
        arm = self._arm
        configuration, state = self.solver.step_elbow(
            arm.geometry, arm.bend_nodes, self._shoulder, self._state, direction, reach, up, seconds
        )
        return ArmConfiguration(*configuration), state
