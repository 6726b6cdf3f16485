from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINTS, Figure, standard_figure, world_transforms
from examples.robot.joints import HINGE_COUNT, HINGES, LOWER, UPPER
from examples.robot.model import BODY_MASS_INDEX, body_height, build_model
from examples.robot.targets import angles_to_rotations


def small_figure() -> Figure:
    figure = standard_figure()
    return replace(figure, offsets=figure.offsets * 0.7, tips=figure.tips * 0.7)


@pytest.mark.parametrize("figure", [standard_figure(), small_figure()])
def test_masses_of_segments_sum_to_the_body(figure: Figure) -> None:
    geoms = ElementTree.fromstring(build_model(figure)).iter("geom")
    mass = sum(float(geom.get("mass", "0")) for geom in geoms)
    assert mass == pytest.approx(BODY_MASS_INDEX * body_height(figure) ** 2, rel=1e-3)


def test_each_motor_has_a_limited_torque_and_a_hinge_with_a_range() -> None:
    model = ElementTree.fromstring(build_model(standard_figure()))
    joints = {joint.get("name"): joint for joint in model.iter("joint") if joint.get("name")}
    motors = list(model.iter("position"))
    assert len(motors) == HINGE_COUNT
    for motor, hinge in zip(motors, HINGES, strict=True):
        lower, upper = map(float, joints[motor.get("joint")].get("range", "").split())
        assert (lower, upper) == pytest.approx((hinge.lower, hinge.upper), abs=1e-5)
        assert motor.get("forcerange") == f"{-hinge.torque:g} {hinge.torque:g}"


def test_bodies_are_where_the_figure_has_its_joints() -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    figure, generator = standard_figure(), np.random.default_rng(5)
    model = mujoco.MjModel.from_xml_string(build_model(figure))
    data = mujoco.MjData(model)
    for _ in range(20):
        angles = generator.uniform(LOWER, UPPER)
        rotations = angles_to_rotations(angles)
        rotations[0] = rotation.normalise(generator.normal(size=4))
        root = generator.normal(size=3)
        data.qpos[:3], data.qpos[3:7] = root, rotations[0]
        for nth, angle in enumerate(angles):
            data.qpos[model.joint(f"hinge{nth}").qposadr[0]] = angle
        mujoco.mj_kinematics(model, data)
        positions, orientations = world_transforms(figure, root, rotations)
        for joint, name in enumerate(JOINTS):
            if joint > 1 and not name.endswith("midtarsal"):
                body = data.body(name)
                assert body.xpos == pytest.approx(positions[joint], abs=1e-5)
                assert abs(body.xquat @ orientations[joint]) == pytest.approx(1.0, abs=1e-9)
