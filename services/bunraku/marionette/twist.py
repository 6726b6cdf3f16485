"""Twist of an arm's bones, limited from frame to frame."""

from __future__ import annotations

from bunraku.marionette.solver import vector
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.marionette.solver.twist_step import NO_TWIST_LAG, BoneDirections
from bunraku.marionette.solver.vector import JointRotations, Vector


class TwistLimiter:
    """Limit of the speed at which the three bones of one arm turn about their own axes."""

    def __init__(self, bones: tuple[Vector, Vector, Vector], solver: LimbSolver = PYTHON_SOLVER) -> None:
        """`bones` are the bones at rest, of any length."""
        first, second, third = (vector.unit(bone, (0.0, -1.0, 0.0)) for bone in bones)
        self.solver = solver
        self._directions: BoneDirections = (first, second, third)
        self._orientations: JointRotations | None = None
        self.lag_rad: Vector = NO_TWIST_LAG
        """Twist of each shown bone relative to the requested one, within `MAX_TWIST_LAG_RAD` either way."""

    def limit(self, joints: JointRotations, share: float, seconds: float) -> JointRotations:
        """Return the shown joints, `seconds` after the last call: those nearest to `joints` at a bounded twist speed.

        Joint positions stay, and no bone's twist differs by more than `share` (0..1) of `MAX_TWIST_LAG_RAD`. The
        result is `joints` at the first call and whenever no bone lags.
        """
        if self._orientations is None:
            first, second, third = joints
            second = vector.multiply(first, second)
            self._orientations = (first, second, vector.multiply(second, third))
            return joints
        shown, self._orientations, self.lag_rad = self.solver.limit_twist(
            self._directions, self._orientations, self.lag_rad, joints, share, seconds
        )
        return joints if self.lag_rad == NO_TWIST_LAG else shown
