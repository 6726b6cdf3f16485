"""Constants of the limb solver that Python and TypeScript share.

The values come from `proto/constants.json`, part of the contract: a puppeteer's client predicts a limb with the same
constants as the session service. Lengths are in arm lengths, angles in radians. A quantity of a limb is in arm
lengths for a hand and in radians for a thigh.
"""

from __future__ import annotations

import json
from importlib import resources
from math import radians
from typing import Any

CONSTANTS: dict[str, Any] = json.loads(
    resources.files("bunraku.marionette").joinpath("constants.json").read_text(encoding="utf-8")
)
"""The file's content by key. The unit of a value is the end of its key."""


def _float(key: str) -> float:
    return float(CONSTANTS[key])


def _radians(key: str) -> float:
    return radians(float(CONSTANTS[key]))


def _triple(values: list[float]) -> tuple[float, float, float]:
    a, b, c = values
    return (float(a), float(b), float(c))


# Proportions and reach
ARM_MASS_RATIOS = _triple(CONSTANTS["arm_mass_ratios"])
"""Masses of upper arm, forearm and hand per body mass (Winter, Biomechanics and Motor Control, table 4.1)."""
ARM_LENGTH_RATIOS = _triple(CONSTANTS["arm_length_ratios"])
"""Lengths of the same per body height (Drillis and Contini 1966, in Winter, figure 4.1)."""
MAX_ELBOW_BEND_RAD = _radians("max_elbow_bend_deg")
MAX_WRIST_BEND_RAD = _radians("max_wrist_bend_deg")
MAX_TIP_DISTANCE = 1.0 - _float("full_stretch_margin_arm_lengths")
"""Largest solved distance of the hand tip: a fully straight arm has no bend left to choose."""
MIN_TIP_DISTANCE = _float("min_tip_distance_arm_lengths")
"""Lower bound of the smallest solved distance of the hand tip."""
MIN_TIP_DISTANCE_FACTOR = _float("min_tip_distance_factor")
"""Smallest solved distance per smallest distance that the joint limits allow."""
MIN_TARGET_DISTANCE = _float("min_target_distance_arm_lengths")
"""A target nearer to the shoulder has no direction and counts as straight below."""
TABLE_SIDE = int(CONSTANTS["bend_table_nodes_per_side"])
"""Nodes per side of a bend table: rows by distance, columns from straight down to straight up."""
MAX_REACH = _float("max_reach_arm_lengths")
"""Largest distance of a controlled hand: the arm never locks, so that the elbow straightens out at a bounded speed."""
MIN_REACH = _float("min_reach_arm_lengths")
"""Smallest distance of a controlled hand from the shoulder: nearer in, the elbow would have to whirl."""
MIN_THIGH_ANGLE_RAD = _radians("min_thigh_angle_deg")
MAX_THIGH_ANGLE_RAD = _radians("max_thigh_angle_deg")

# Elbow
HALF_SWING_DISTANCE = _float("half_swing_distance_arm_lengths")
"""Distance from the vertical axis at which the swing rate is half of its value far away."""
SWING_HALF_LIFE_S = _float("swing_half_life_s")
"""Time in which the remaining swing halves, far from the vertical axis."""
MAX_SWING_SPEED_RAD_S = _radians("max_swing_speed_deg_per_s")
MIN_SWING_SPEED = _float("min_swing_speed_arm_lengths_per_s")
"""Elbow speed that is always available for the swing, arm lengths per second."""
MAX_ELBOW_SPEED = _float("max_elbow_speed_arm_lengths_per_s")
"""Elbow speed, arm lengths per second. The swing gets what hand motion and change of bend leave of it."""
MAX_OFFSET_PER_SLACK = _float("max_elbow_offset_per_slack_ratio")
"""Largest distance of the elbow from the chord per distance of the tip from full stretch.

Gravity alone would straighten the elbow with the last of the slack.
"""
MAX_LIFT_SPEED = _float("max_lift_speed_arm_lengths_per_s")
"""Speed at which the elbow leaves or nears the chord beyond what the tip requires, arm lengths per second."""
CAP_CLEARANCE_RAD = _float("cap_clearance_rad")
"""Clearance of the upper arm from an exclusion cap of the shoulder."""
CAP_EDGE_MARGIN_RAD = _float("cap_edge_margin_rad")
"""Tolerance of tests against the edge of an exclusion cap."""
LEFT_SHOULDER_CAPS = tuple(
    (_triple(cap["axis_xyz"]), radians(float(cap["radius_deg"]))) for cap in CONSTANTS["left_shoulder_caps"]
)
"""Axes (not of unit length) and radii of the caps of directions that the left upper arm cannot take.

Ranges: American Academy of Orthopaedic Surgeons, Joint Motion (1965), rounded out. In order:

- straight back: extension ends at 60 degrees, horizontal abduction 45 to 50 behind the side
- up and back: flexion and abduction end overhead, at 180 degrees
- across the back: no farther than the arm's own side
- across the chest: horizontal adduction ends at 130 to 140 degrees from the side
"""

# Twist and blending
MAX_TWIST_SPEED_RAD_S = _radians("max_twist_speed_deg_per_s")
"""Speed at which a bone turns about its own axis."""
MAX_TWIST_LAG_RAD = _radians("max_twist_lag_deg")
"""Largest lag of a bone's twist; beyond it, the bone turns the other way round."""
SWIVEL_RESET_WEIGHT = _float("swivel_reset_weight")
"""Weight up to which the elbow takes the shortest way round again: the earlier way is hardly visible."""
DISTANCE_WEIGHT = _float("distance_weight_per_arm_length")
"""Blend weight per distance between target and the motion's tip: distant arms may differ in twist at any weight."""
MIN_HALF_ANGLE_COSINE = _float("min_half_angle_cosine")
"""Cosine of half the angle (270 degrees) up to which a joint keeps its way round although the other is shorter."""

# Motion of a controlled limb
MAX_TARGET_SPEED = _float("max_target_speed_arm_lengths_or_rad_per_s")
"""A target that moves faster has jumped, and its velocity is not followed."""
MAX_LIMB_SPEED = _float("max_limb_speed_arm_lengths_or_rad_per_s")
SHOULDER_CLEARANCE = _float("shoulder_clearance_arm_lengths")
"""Distance from the shoulder that a passing hand keeps: it takes a way round."""
BLEND_IN_S = _float("blend_in_s")
"""Duration of the blend from the motion's joints to the solver's."""
BLEND_OUT_S = _float("blend_out_s")
"""Duration of the blend from the solver's joints to the motion's."""
HAND_ACCELERATION = _float("hand_acceleration_arm_lengths_per_s2")
"""Acceleration of a controlled hand: a quarter of an arm takes 0.11 s."""
THIGH_ACCELERATION = _float("thigh_acceleration_rad_per_s2")
RETURN_DURATION_S = _float("return_duration_s")
"""Time in which a released limb returns to the motion, where its bounds of acceleration allow that."""
MIN_RETURN_ACCELERATION = _float("min_return_acceleration_arm_lengths_or_rad_per_s2")
MAX_HAND_RETURN_ACCELERATION = _float("max_hand_return_acceleration_arm_lengths_per_s2")
"""Acceleration of a returning hand relative to the motion."""
ARRIVAL_TOLERANCE = _float("arrival_tolerance_arm_lengths_or_rad")
"""Distance from the motion within which a returning limb has arrived."""
MIN_SOLVE_WEIGHT = _float("min_solve_weight")
"""Blend weight of a limb that is still returning although its blend is over."""

# Bonds of two hands
BOND_JOIN_ACCELERATION = _float("bond_join_acceleration_arm_lengths_per_s2")
"""Acceleration with which two bonded hands approach each other."""
BOND_BEGIN_ACCELERATION = _float("bond_begin_acceleration_arm_lengths_per_s2")
"""Acceleration of the pair until its hands have met; with that of the hands less than `HAND_ACCELERATION`."""
MAX_BOND_BEGIN_SPEED = _float("max_bond_begin_speed_arm_lengths_per_s")
"""Speed at which the pair begins to move; the offsets of its hands take the rest of their velocity."""
BOND_BORDER_MARGIN = _float("bond_border_margin_arm_lengths")
"""Distance that a pair keeps from the border of the reach: on a fast way along it the pair may come nearer."""
MAX_BOND_STRETCH = _float("max_bond_stretch_ratio")
"""Distance of two shoulders, per sum of both reaches, beyond which a bond ends: the common reach shrinks to a point."""
RECENCY_HALF_LIFE_S = _float("recency_half_life_s")
"""Age of an input that halves the weight of its goal."""
SHARE_HALF_LIFE_S = _float("share_half_life_s")
"""Time in which the shown weight of a goal comes half as near to the present one."""
MIN_SHARE = _float("min_share_ratio")
"""Share of a bonded hand's goal below which the goal follows the pair."""

# Controller input
MAX_HAND_SPEED = _float("full_hand_speed_arm_lengths_per_s")
"""Speed of a hand along one axis at full deflection."""
MAX_LEG_SPEED = _float("full_leg_speed_rad_per_s")
"""Speed of a thigh at full deflection."""
MAX_TARGET_DURATION_US = int(CONSTANTS["max_target_duration_us"])
"""Longest interpolation to a new target."""
