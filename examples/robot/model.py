"""MuJoCo model (MJCF) of the robot, built from the limb lengths of a performer.

Frame of the stage: metres, y up. Body `sacroiliac` is the pelvis and moves freely, with its origin at the figure's
root; the toes are part of the foot. Capsules are limbs, boxes feet. Masses are shares of the body's, from the
anthropometric table of Winter (Biomechanics and Motor Control of Human Movement). Limbs do not collide with each other,
only with the floor.
"""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Figure, joint_and_tip_positions
from examples.robot.joints import HINGES, hinge_direction

TIME_STEP_S = 0.004
MASS_SHARES = {
    "pelvis": 0.142,
    "vl5": 0.355,
    "skullbase": 0.081,
    "shoulder": 0.028,
    "elbow": 0.016,
    "wrist": 0.006,
    "hip": 0.1,
    "knee": 0.0465,
    "ankle": 0.0145,
}
"""Share of the body's mass by segment, named after the joint above it; paired segments one side each."""
BODY_MASS_INDEX = 22.0
"""Mass in kg for the square of the height in metres."""
RADII = {"shoulder": 0.045, "elbow": 0.036, "wrist": 0.03, "hip": 0.07, "knee": 0.05}
"""Radii of the limbs' capsules for a height of 1.75 m, metres."""
FOOT_WIDTH, FOOT_HEIGHT, HEEL_LENGTH = 0.09, 0.05, 0.06
REST_HEIGHT = 1.75
LIMIT_MARGIN = np.radians(5.0)
"""Angle before the end of a hinge's range from which MuJoCo's soft limit pushes back, radians."""


def body_height(figure: Figure) -> float:
    """Return the height of a figure at rest, crown to toes, in metres."""
    points = joint_and_tip_positions(figure, figure.offsets[0], np.tile([1.0, 0, 0, 0], (18, 1)))
    return float(np.ptp(points[:, 1]))


def sole_height(figure: Figure) -> float:
    """Return the height of the lowest point of the feet at rest, under the root's rest position, in metres."""
    points = joint_and_tip_positions(figure, figure.offsets[0], np.tile([1.0, 0, 0, 0], (18, 1)))
    return float(points[:, 1].min())


def _numbers(values: Array | list[float] | tuple[float, ...]) -> str:
    return " ".join(f"{value:.6g}" for value in values)


def build_model(figure: Figure) -> str:
    """Return the MJCF of the robot of a figure. Its `sacroiliac` has the rest position and orientation of the root."""
    height = body_height(figure)
    scale, mass = height / REST_HEIGHT, BODY_MASS_INDEX * height**2
    root = ElementTree.Element("mujoco", model="bunraku")
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    ElementTree.SubElement(
        root, "option", timestep=f"{TIME_STEP_S}", gravity="0 -9.81 0", integrator="implicitfast", cone="elliptic"
    )
    default = ElementTree.SubElement(root, "default")
    ElementTree.SubElement(default, "geom", contype="1", conaffinity="0", friction="0.9 0.02 0.001", rgba=".8 .75 .7 1")
    ElementTree.SubElement(
        default, "joint", damping="0.3", armature="0.02", solreflimit="0.01 1", solimplimit="0.98 0.999 0.002"
    )
    world = ElementTree.SubElement(root, "worldbody")
    ElementTree.SubElement(world, "light", pos="0 4 2", dir="0 -1 -0.5")
    floor = {"name": "floor", "type": "plane", "size": "20 20 0.1", "zaxis": "0 1 0", "rgba": ".3 .3 .3 1"}
    ElementTree.SubElement(world, "geom", floor | {"contype": "0", "conaffinity": "1"})
    pelvis = ElementTree.SubElement(world, "body", name="sacroiliac", pos=_numbers(figure.offsets[0]))
    ElementTree.SubElement(pelvis, "freejoint", name="root")
    hip = figure.offsets[1] + figure.offsets[JOINT_INDEX["l_hip"]]
    other = figure.offsets[1] + figure.offsets[JOINT_INDEX["r_hip"]]
    _add_capsule(pelvis, hip, other, 0.08 * scale, MASS_SHARES["pelvis"] * mass)
    trunk = _add_trunk(pelvis, figure, scale, mass)
    for side in ("l_", "r_"):
        _add_leg(pelvis, figure, side, scale, mass)
        _add_arm(trunk, figure, side, scale, mass)
    _add_motors(root)
    return ElementTree.tostring(root, encoding="unicode")


def _add_body(parent: ElementTree.Element, name: str, position: Array) -> ElementTree.Element:
    """Add the body of a joint of the figure, with its hinges."""
    body = ElementTree.SubElement(parent, "body", name=name, pos=_numbers(position))
    for nth, hinge in enumerate(HINGES):
        if hinge.joint == JOINT_INDEX[name]:
            ElementTree.SubElement(
                body,
                "joint",
                name=f"hinge{nth}",
                type="hinge",
                axis=_numbers(hinge_direction(hinge)),
                range=_numbers([hinge.lower, hinge.upper]),
                margin=f"{LIMIT_MARGIN:.6g}",
            )
    return body


def _add_capsule(body: ElementTree.Element, start: Array, end: Array, radius: float, mass: float) -> None:
    # a limb of length zero is a sphere
    if np.linalg.norm(end - start) < 1e-3:
        ElementTree.SubElement(body, "geom", type="sphere", size=f"{radius}", pos=_numbers(start), mass=f"{mass}")
        return
    ends = _numbers([*start, *end])
    ElementTree.SubElement(body, "geom", type="capsule", size=f"{radius}", fromto=ends, mass=f"{mass}")


def _add_trunk(pelvis: ElementTree.Element, figure: Figure, scale: float, mass: float) -> ElementTree.Element:
    trunk = _add_body(pelvis, "vl5", figure.offsets[JOINT_INDEX["vl5"]])
    shoulders = figure.offsets[[JOINT_INDEX["l_shoulder"], JOINT_INDEX["r_shoulder"]]]
    chest = shoulders.mean(axis=0)
    share = MASS_SHARES["vl5"] * mass / 2
    _add_capsule(trunk, np.zeros(3), chest * 0.8, 0.1 * scale, share)
    _add_capsule(trunk, chest + (shoulders[0] - chest) * 0.7, chest + (shoulders[1] - chest) * 0.7, 0.07 * scale, share)
    head = _add_body(trunk, "skullbase", figure.offsets[JOINT_INDEX["skullbase"]])
    tip = figure.tips[JOINT_INDEX["skullbase"]]
    _add_capsule(head, tip * 0.3, tip * 0.55, 0.075 * scale, MASS_SHARES["skullbase"] * mass)
    return trunk


def _add_arm(trunk: ElementTree.Element, figure: Figure, side: str, scale: float, mass: float) -> None:
    body = trunk
    for name, below in (("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", None)):
        body = _add_body(body, side + name, figure.offsets[JOINT_INDEX[side + name]])
        end = figure.offsets[JOINT_INDEX[side + below]] if below else figure.tips[JOINT_INDEX[side + name]] * 0.85
        _add_capsule(body, np.zeros(3), end, RADII[name] * scale, MASS_SHARES[name] * mass)


def _add_leg(pelvis: ElementTree.Element, figure: Figure, side: str, scale: float, mass: float) -> None:
    body, offset = pelvis, figure.offsets[1]
    for name, below in (("hip", "knee"), ("knee", "ankle")):
        body = _add_body(body, side + name, offset + figure.offsets[JOINT_INDEX[side + name]])
        end = figure.offsets[JOINT_INDEX[side + below]]
        _add_capsule(body, np.zeros(3), end, RADII[name] * scale, MASS_SHARES[name] * mass)
        offset = np.zeros(3)
    foot = _add_body(body, side + "ankle", figure.offsets[JOINT_INDEX[side + "ankle"]])
    ball = figure.offsets[JOINT_INDEX[side + "midtarsal"]]
    toes = ball + figure.tips[JOINT_INDEX[side + "midtarsal"]]
    back, front = -HEEL_LENGTH * scale, max(float(toes[2]), 0.1 * scale)
    sole = min(float(toes[1]), float(ball[1]), -0.02 * scale)
    thickness = FOOT_HEIGHT * scale
    centre = [float(toes[0]) / 2, sole + thickness / 2, (front + back) / 2]
    half = [FOOT_WIDTH * scale / 2, thickness / 2, (front - back) / 2]
    share = MASS_SHARES["ankle"] * mass
    ElementTree.SubElement(foot, "geom", type="box", pos=_numbers(centre), size=_numbers(half), mass=f"{share}")


def _add_motors(root: ElementTree.Element) -> None:
    """Add one position servo for each hinge, whose torque is limited."""
    actuator = ElementTree.SubElement(root, "actuator")
    for nth, hinge in enumerate(HINGES):
        ElementTree.SubElement(
            actuator,
            "position",
            name=f"motor{nth}",
            joint=f"hinge{nth}",
            kp=f"{hinge.stiffness}",
            kv=f"{hinge.damping}",
            forcerange=_numbers([-hinge.torque, hinge.torque]),
        )
