from __future__ import annotations

import numpy as np
import pytest

from bunraku.marionette import arm_batch, bend_table
from bunraku.marionette.arm import close_chain, wrist_bend_limits
from bunraku.marionette.bodies import BODIES, Body
from bunraku.marionette.constants import MAX_TIP_DISTANCE
from tests.bench import ik_accuracy
from tests.bench.ik import report_speeds, wandering_targets
from tests.bench.ik_peers import SlsqpSolver

each_body = pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)


@each_body
def test_arm_accuracy_is_within_documented_bounds(body: Body) -> None:
    proportions = body.proportions.rounded()
    found = ik_accuracy.measure_accuracy(
        proportions, bend_table.load_bend_table(proportions.identity), 4_000, np.random.default_rng(2)
    )
    assert found.tip_error_max <= 1e-9
    assert found.limits_broken_by <= 1e-9
    assert found.angle_error_mean_deg <= 0.02
    assert found.angle_error_p99_deg <= 0.45
    assert found.paper_tip_mean <= 0.0004
    assert found.paper_tip_max <= 0.003


@each_body
def test_minimum_energy_is_below_every_other_bend(body: Body) -> None:
    random = np.random.default_rng(3)
    r, beta = random.uniform(body.proportions.min_tip_distance, MAX_TIP_DISTANCE, 300), random.uniform(-1.57, 1.57, 300)
    t0, t1, t2 = ik_accuracy.minimum_energy_angles(body.proportions, r, beta)
    lowest = ik_accuracy.potential_energy(body.proportions, (t0, t1, t2))
    low, high = wrist_bend_limits(body.proportions, r)
    for share in random.uniform(0.0, 1.0, 200):
        other = close_chain(body.proportions, r, beta, low + share * (high - low))
        assert (ik_accuracy.potential_energy(body.proportions, other) >= lowest - 1e-12).all()


def test_slsqp_finds_the_same_arm_away_from_limits() -> None:
    proportions = BODIES[0].proportions.rounded()
    targets = ik_accuracy.random_reachable_targets(proportions, 60, np.random.default_rng(7))
    solved = arm_batch.solve_arms(proportions, bend_table.load_bend_table(proportions.identity), targets)
    angles = np.array(solved.angles())
    r, peer, compared = np.linalg.norm(targets, axis=1), SlsqpSolver(proportions), 0
    low, high = wrist_bend_limits(proportions, r)
    for nth, (x, y, z) in enumerate(targets.tolist()):
        bend = angles[2, nth] - angles[1, nth]
        # started beside the solution, as it may otherwise end in another local minimum
        peer.angles = angles[:, nth] + 0.05
        if low[nth] + 0.05 < bend < high[nth] - 0.05:
            assert peer.reach(float(np.hypot(x, z)), y) < 1e-6
            assert np.degrees(np.abs(peer.angles - angles[:, nth])).max() < 0.5
            compared += 1
    assert compared > 10


def test_path_moves_at_half_an_arm_length_per_second() -> None:
    path = wandering_targets(BODIES[2].proportions, 20_000)
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1) * 60.0
    assert 0.4 < speed.mean() < 0.6
    assert speed.max() < 2.0
    reach = np.linalg.norm(path, axis=1)
    assert BODIES[2].proportions.min_tip_distance < reach.min() < 0.2
    assert 0.95 < reach.max() < MAX_TIP_DISTANCE


def test_speed_ratio_is_computed_within_one_round(capsys: pytest.CaptureFixture[str]) -> None:
    names = ("ours", "ccdik_10", "ccdik_10_with_limits", "closed_chain_ik", "compiled", "numpy", "slsqp")
    rates = {order: {name: [600.0, 100.0, 200.0] for name in names} for order in ("jumps", "path")}
    rates["jumps"]["ccdik_10"], rates["path"]["slsqp"] = [2.0, 1.0, 1.0], [100.0, 50.0, 10.0]
    figures = report_speeds(rates, {"jumps": {"ours": 0.0}, "path": {}})
    assert figures["solves_per_s_typescript"] == figures["solves_per_s_python"] == 200.0
    assert figures["times_ccdik_10"] == 200.0
    assert figures["times_slsqp_path"] == 6.0
    assert figures["times_slsqp"] == 1.0
    assert "path" in capsys.readouterr().out
