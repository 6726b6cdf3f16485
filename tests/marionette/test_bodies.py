from __future__ import annotations

import numpy as np
import pytest

from bunraku.marionette.bodies import BODIES
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.motion.skeleton import standard_figure


def test_bodies_differ_and_name_their_source() -> None:
    assert [body.name for body in BODIES] == ["Winter", "de Leva", "H-Anim"]
    assert len({body.proportions.identity for body in BODIES}) == 3
    assert all(body.source for body in BODIES)


def test_h_anim_body_equals_the_standard_figure() -> None:
    rig = ArmRig(standard_figure(), Limb.LEFT_HAND)
    assert rig.arm.proportions.lengths == pytest.approx(BODIES[2].proportions.lengths, abs=1e-6)
    assert rig.arm.proportions.masses == pytest.approx(BODIES[2].proportions.masses, abs=1e-6)
    assert np.isclose(sum(rig.arm.proportions.masses), 1.0)
