"""The most expensive functions of a controlled limb, in plain Python or compiled.

Both solvers return the same numbers to the last bit. A stage starts with `PYTHON_SOLVER`; importing numba takes
seconds, and the first compilation takes longer. `bunraku.kernels.load_kernels("marionette").compile_solver` returns the
compiled solver.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from bunraku.marionette.solver import arm_joints, elbow_step, follower_step, twist_step
from bunraku.marionette.solver.elbow_step import ElbowState
from bunraku.marionette.solver.planar_arm import ArmGeometry
from bunraku.marionette.solver.shoulder import ShoulderLimit
from bunraku.marionette.solver.twist_step import BoneDirections
from bunraku.marionette.solver.vector import JointRotations, Vector
from bunraku.motion.rotation import Array


class LimbSolver(NamedTuple):
    """The functions of numbers and plain tuples that move one limb by one frame."""

    step_elbow: Callable[
        [ArmGeometry, Array, ShoulderLimit, ElbowState, Vector, float, Vector, float],
        tuple[tuple[Vector, Vector, float], ElbowState],
    ]
    advance: Callable[
        [Vector, Vector, Vector, Vector, Vector, Vector, float, float, float, float], tuple[Vector, Vector]
    ]
    bend_links: Callable[[ArmGeometry, JointRotations, float, float, float], JointRotations]
    joint_positions: Callable[[tuple[Vector, Vector, Vector], JointRotations], tuple[Vector, Vector, Vector]]
    limit_twist: Callable[
        [BoneDirections, JointRotations, Vector, JointRotations, float, float],
        tuple[JointRotations, JointRotations, Vector],
    ]


PYTHON_SOLVER = LimbSolver(
    elbow_step.step_elbow,
    follower_step.advance,
    arm_joints.bend_links,
    arm_joints.joint_positions,
    twist_step.limit_twist,
)
"""The solver in plain Python."""
