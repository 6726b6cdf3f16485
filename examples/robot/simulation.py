"""Simulated robot: follows poses of a performer with limited torques, hanging from strings or standing free."""

from __future__ import annotations

import time

import mujoco
import numpy as np
from numpy.typing import NDArray

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Figure, joint_and_tip_positions
from examples.robot.joints import DAMPING, HINGE_COUNT, IS_LEG, STIFFNESS
from examples.robot.measurement import Measurement, bone_errors
from examples.robot.model import TIME_STEP_S, build_model
from examples.robot.strings import string_forces
from examples.robot.targets import TargetFinder, angles_to_rotations, pelvis_orientation

MEASURE_EVERY = 6
"""Frames from one measured tracking error to the next. Limits are checked in each step."""
MAX_CATCH_UP_S = 0.1
"""Longest time that one frame simulates; after a longer pause the robot goes on where it was."""
FALL_TILT = np.radians(60.0)
"""Tilt of the pelvis against the performer's, from which the robot has fallen, radians."""
FALL_HEIGHT_SHARE = 0.6
"""Share of the performer's root height, below which the robot has fallen."""
_UP = np.array([0.0, 1.0, 0.0])

Pose = tuple[Array, Array]
"""Root (3,) in metres and rotations (18, 4) of the joints in the frames of their parents."""


class Robot:
    """Robot of a performer's figure. `free` cuts the strings."""

    def __init__(self, figure: Figure, *, free: bool = False) -> None:
        self.figure = figure
        self.free = free
        self.measurement = Measurement()
        self.model = mujoco.MjModel.from_xml_string(build_model(figure))
        self.data = mujoco.MjData(self.model)
        self.mass = float(self.model.body_mass.sum())
        # the tree of bodies orders the hinges in another way
        joints = [self.model.joint(f"hinge{nth}") for nth in range(HINGE_COUNT)]
        self._positions = np.array([joint.qposadr[0] for joint in joints])
        self._speeds = np.array([joint.dofadr[0] for joint in joints])
        self._ghost = mujoco.MjData(self.model)
        """Kinematics of the wanted pose, which is not simulated."""
        self._finder = TargetFinder()
        self._frames = 0
        self._remaining_s = 0.0
        self._is_placed = False
        self._string_bodies, self._string_points = _attach_strings(self.model, figure)

    @property
    def pose(self) -> Pose:
        """Present pose of the robot, as a pose of the figure."""
        rotations = angles_to_rotations(self.data.qpos[self._positions])
        rotations[0] = rotation.normalise(self.data.qpos[3:7])
        return self.data.qpos[:3].copy(), rotations

    def follow(self, pose: Pose, seconds: float) -> bool:
        """Simulate `seconds` towards a pose of the performer; return whether the robot fell and was set up again.

        At most `MAX_CATCH_UP_S` are simulated. A pose that is not finite is ignored.
        """
        root, rotations = pose
        if not (np.isfinite(root).all() and np.isfinite(rotations).all()):
            return False
        started = time.perf_counter()
        seconds = min(max(seconds, 0.0), MAX_CATCH_UP_S)
        previous = self._finder.angles
        targets = self._finder.update(rotations, seconds)
        speeds = (targets - previous) / seconds if self._is_placed and seconds > 0 else np.zeros(HINGE_COUNT)
        if not self._is_placed:
            self._place(root, rotations, targets)
        wanted = self._wanted_points(root, rotations, targets)
        self._remaining_s += seconds
        is_unstable = False
        while self._remaining_s >= TIME_STEP_S and not is_unstable:
            self._remaining_s -= TIME_STEP_S
            is_unstable = not self._step(targets, speeds, wanted)
        has_fallen = not is_unstable and self._has_fallen(root, rotations)
        if is_unstable or has_fallen:
            self.measurement.unstable += is_unstable
            self.measurement.falls += has_fallen
            self._place(root, rotations, targets)
        elif self._frames % MEASURE_EVERY == 0:
            reached_root, reached = self.pose
            self.measurement.add_frame(
                self.data.qpos[self._positions] - targets,
                bone_errors(self.figure, rotations, reached),
                float(np.linalg.norm(root - reached_root)),
            )
        self._frames += 1
        self.measurement.computed_s += time.perf_counter() - started
        return has_fallen

    def _place(self, root: Array, rotations: Array, targets: Array) -> None:
        """Set the robot up in the performer's pose, at rest, with its lowest point on the floor or above."""
        mujoco.mj_resetData(self.model, self.data)
        orientation = pelvis_orientation(rotations)
        self.data.qpos[:3] = root
        self.data.qpos[3:7] = orientation
        self.data.qpos[self._positions] = targets
        own = angles_to_rotations(targets)
        own[0] = orientation
        lowest = joint_and_tip_positions(self.figure, root, own)[:, 1].min()
        self.data.qpos[1] += max(-float(lowest), 0.0)
        self.data.ctrl[:] = targets
        mujoco.mj_forward(self.model, self.data)
        self._is_placed = True

    def _step(self, targets: Array, speeds: Array, wanted: Array) -> bool:
        """Simulate one step; return whether the simulation is stable."""
        # the motors hold the weight of trunk, head and arms in advance: a servo alone would sag. The strings or the
        # floor hold the legs
        bias = np.where(IS_LEG, 0.0, self.data.qfrc_bias[self._speeds])
        self.data.ctrl[:] = targets + (bias + DAMPING * speeds) / STIFFNESS
        if not self.free:
            self._pull_strings(wanted)
        mujoco.mj_step(self.model, self.data)
        self.measurement.simulated_s += TIME_STEP_S
        self.measurement.add_step(self.data.qpos[self._positions], self.data.qfrc_actuator[self._speeds])
        return bool(np.isfinite(self.data.qpos).all()) and not any(
            self.data.warning[kind].number
            for kind in (mujoco.mjtWarning.mjWARN_BADQACC, mujoco.mjtWarning.mjWARN_BADQPOS)
        )

    def _pull_strings(self, wanted: Array) -> None:
        data, bodies = self.data, self._string_bodies
        points = self._tied_points(data)
        # cvel is the velocity at the centre of mass of the whole tree, rotation first
        spins, centre = data.cvel[bodies, :3], data.subtree_com[1]
        velocities = data.cvel[bodies, 3:] + np.cross(spins, points - centre)
        forces = string_forces(points, velocities, wanted, self.mass)
        data.xfrc_applied[:] = 0.0
        arms = points - data.xipos[bodies]
        np.add.at(data.xfrc_applied, bodies, np.hstack([forces, np.cross(arms, forces)]))

    def _wanted_points(self, root: Array, rotations: Array, targets: Array) -> Array:
        """Return the world positions (n, 3) of the strings' points on the performer, as far as the robot can follow."""
        ghost = self._ghost
        ghost.qpos[:3], ghost.qpos[3:7], ghost.qpos[self._positions] = root, pelvis_orientation(rotations), targets
        mujoco.mj_kinematics(self.model, ghost)
        return self._tied_points(ghost)

    def _tied_points(self, data: mujoco.MjData) -> Array:
        """Return the world positions (n, 3) of the points at which the strings are tied."""
        bodies = self._string_bodies
        points: Array = data.xpos[bodies] + np.einsum(
            "nij,nj->ni", data.xmat[bodies].reshape(-1, 3, 3), self._string_points
        )
        return points

    def _has_fallen(self, root: Array, rotations: Array) -> bool:
        own = rotation.rotate(rotation.normalise(self.data.qpos[3:7]), _UP)
        performer = rotation.rotate(pelvis_orientation(rotations), _UP)
        # heights of the pelvis: a performer who sits or lies down is followed, and does not count as a fall
        is_low = self.data.qpos[1] < FALL_HEIGHT_SHARE * root[1]
        return bool(is_low or np.arccos(np.clip(own @ performer, -1.0, 1.0)) > FALL_TILT)


def _attach_strings(model: mujoco.MjModel, figure: Figure) -> tuple[NDArray[np.intp], Array]:
    """Return the bodies (n,) and the points (n, 3) in their frames at which the strings are tied."""
    hips = [figure.offsets[1] + figure.offsets[JOINT_INDEX[side + "hip"]] for side in ("l_", "r_")]
    shoulders = [figure.offsets[JOINT_INDEX[side + "shoulder"]] for side in ("l_", "r_")]
    head = figure.tips[JOINT_INDEX["skullbase"]]
    tied = [*(("sacroiliac", p) for p in hips), *(("vl5", p) for p in shoulders), ("skullbase", head)]
    return np.array([model.body(name).id for name, _ in tied]), np.array([point for _, point in tied])
