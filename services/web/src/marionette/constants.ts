/**
 * Constants of the limb solver that TypeScript and Python (`marionette/constants.py`) share, from
 * `proto/constants.json`. Lengths are in arm lengths, angles in radians. A quantity of a limb is in arm lengths
 * for a hand and in radians for a thigh.
 */

import values from "../../../../proto/constants.json";

function radians(degrees: number): number {
  return (degrees * Math.PI) / 180;
}

/** Masses of upper arm, forearm and hand per body mass (Winter, Biomechanics and Motor Control, table 4.1). */
export const ARM_MASS_RATIOS: readonly number[] = values.arm_mass_ratios;
/** Lengths of the same per body height (Drillis and Contini 1966, in Winter, figure 4.1). */
export const ARM_LENGTH_RATIOS: readonly number[] = values.arm_length_ratios;
export const MAX_ELBOW_BEND_RAD = radians(values.max_elbow_bend_deg);
export const MAX_WRIST_BEND_DEG = values.max_wrist_bend_deg;
export const MAX_WRIST_BEND_RAD = radians(MAX_WRIST_BEND_DEG);
/** Largest solved distance of the hand tip: a fully straight arm has no bend left to choose. */
export const MAX_TIP_DISTANCE = 1 - values.full_stretch_margin_arm_lengths;
/** Lower bound of the smallest solved distance of the hand tip. */
export const MIN_TIP_DISTANCE = values.min_tip_distance_arm_lengths;
/** Smallest solved distance per smallest distance that the joint limits allow. */
export const MIN_TIP_DISTANCE_FACTOR = values.min_tip_distance_factor;
/** A target nearer to the shoulder has no direction and counts as straight below. */
export const MIN_TARGET_DISTANCE = values.min_target_distance_arm_lengths;
/** Nodes per side of a bend table: rows by distance, columns from straight down to straight up. */
export const TABLE_SIDE = values.bend_table_nodes_per_side;
/** Largest distance of a controlled hand: the arm never locks, so that the elbow bends at a bounded speed. */
export const MAX_REACH = values.max_reach_arm_lengths;
/** Smallest distance of a controlled hand from the shoulder: nearer in, the elbow would have to whirl. */
export const MIN_REACH = values.min_reach_arm_lengths;
export const MIN_THIGH_ANGLE_RAD = radians(values.min_thigh_angle_deg);
export const MAX_THIGH_ANGLE_RAD = radians(values.max_thigh_angle_deg);

/** Distance from the vertical axis at which the swing rate is half of its value far away. */
export const HALF_SWING_DISTANCE = values.half_swing_distance_arm_lengths;
/** Time in which the remaining swing halves, far from the vertical axis. */
export const SWING_HALF_LIFE_S = values.swing_half_life_s;
export const MAX_SWING_SPEED_RAD_S = radians(values.max_swing_speed_deg_per_s);
/** Elbow speed that is always available for the swing, arm lengths per second. */
export const MIN_SWING_SPEED = values.min_swing_speed_arm_lengths_per_s;
/** Elbow speed, arm lengths per second. The swing gets what hand motion and change of bend leave of it. */
export const MAX_ELBOW_SPEED = values.max_elbow_speed_arm_lengths_per_s;
/** Largest distance of the elbow from the chord per distance of the tip from full stretch. */
export const MAX_OFFSET_PER_SLACK = values.max_elbow_offset_per_slack_ratio;
/** Speed at which the elbow leaves or nears the chord beyond what the tip requires, arm lengths per second. */
export const MAX_LIFT_SPEED = values.max_lift_speed_arm_lengths_per_s;
/** Clearance of the upper arm from an exclusion cap of the shoulder. */
export const CAP_CLEARANCE_RAD = values.cap_clearance_rad;
/** Tolerance of tests against the edge of an exclusion cap. */
export const CAP_EDGE_MARGIN_RAD = values.cap_edge_margin_rad;
/**
 * Axes (not of unit length) and radii of the caps of directions that the left upper arm cannot take: straight
 * back, up and back, across the back, across the chest. `marionette/constants.py` names the source of the ranges.
 */
export const LEFT_SHOULDER_CAPS = values.left_shoulder_caps.map((cap) => ({
  axis: cap.axis_xyz,
  radius: radians(cap.radius_deg),
}));

/** Speed at which a bone turns about its own axis. */
export const MAX_TWIST_SPEED_RAD_S = radians(values.max_twist_speed_deg_per_s);
/** Largest lag of a bone's twist; beyond it, the bone turns the other way round. */
export const MAX_TWIST_LAG_RAD = radians(values.max_twist_lag_deg);
/** Weight up to which the elbow takes the shortest way round again: the earlier way is hardly visible. */
export const SWIVEL_RESET_WEIGHT = values.swivel_reset_weight;
/** Blend weight per distance between target and the motion's tip: distant arms may differ in twist at any weight. */
export const DISTANCE_WEIGHT = values.distance_weight_per_arm_length;
/** Cosine of half the angle (270 degrees) up to which a joint keeps its way round although the other is shorter. */
export const MIN_HALF_ANGLE_COSINE = values.min_half_angle_cosine;

/** A target that moves faster has jumped, and its velocity is not followed. */
export const MAX_TARGET_SPEED = values.max_target_speed_arm_lengths_or_rad_per_s;
export const MAX_LIMB_SPEED = values.max_limb_speed_arm_lengths_or_rad_per_s;
/** Distance from the shoulder that a passing hand keeps: it takes a way round. */
export const SHOULDER_CLEARANCE = values.shoulder_clearance_arm_lengths;
/** Duration of the blend from the motion's joints to the solver's. */
export const BLEND_IN_S = values.blend_in_s;
/** Duration of the blend from the solver's joints to the motion's. */
export const BLEND_OUT_S = values.blend_out_s;
/** Acceleration of a controlled hand: a quarter of an arm takes 0.11 s. */
export const HAND_ACCELERATION = values.hand_acceleration_arm_lengths_per_s2;
export const THIGH_ACCELERATION = values.thigh_acceleration_rad_per_s2;
/** Time in which a released limb returns to the motion, where its bounds of acceleration allow that. */
export const RETURN_DURATION_S = values.return_duration_s;
export const MIN_RETURN_ACCELERATION = values.min_return_acceleration_arm_lengths_or_rad_per_s2;
/** Acceleration of a returning hand relative to the motion. */
export const MAX_HAND_RETURN_ACCELERATION = values.max_hand_return_acceleration_arm_lengths_per_s2;
/** Distance from the motion within which a returning limb has arrived. */
export const ARRIVAL_TOLERANCE = values.arrival_tolerance_arm_lengths_or_rad;
/** Blend weight of a limb that is still returning although its blend is over. */
export const MIN_SOLVE_WEIGHT = values.min_solve_weight;

/** Acceleration with which two bonded hands approach each other. */
export const BOND_JOIN_ACCELERATION = values.bond_join_acceleration_arm_lengths_per_s2;
/** Acceleration of the pair until its hands have met; with that of the hands less than `HAND_ACCELERATION`. */
export const BOND_BEGIN_ACCELERATION = values.bond_begin_acceleration_arm_lengths_per_s2;
/** Speed at which the pair begins to move; the offsets of its hands take the rest of their velocity. */
export const MAX_BOND_BEGIN_SPEED = values.max_bond_begin_speed_arm_lengths_per_s;
/** Distance that a pair keeps from the border of the reach: on a fast way along it the pair may come nearer. */
export const BOND_BORDER_MARGIN = values.bond_border_margin_arm_lengths;
/** Distance of two shoulders, per sum of both reaches, beyond which a bond ends. */
export const MAX_BOND_STRETCH = values.max_bond_stretch_ratio;
/** Age of an input that halves the weight of its goal. */
export const RECENCY_HALF_LIFE_S = values.recency_half_life_s;
/** Time in which the shown weight of a goal comes half as near to the present one. */
export const SHARE_HALF_LIFE_S = values.share_half_life_s;
/** Share of a bonded hand's goal below which the goal follows the pair. */
export const MIN_SHARE = values.min_share_ratio;

/** Speed of a hand along one axis at full deflection. */
export const MAX_HAND_SPEED = values.full_hand_speed_arm_lengths_per_s;
/** Speed of a thigh at full deflection. */
export const MAX_LEG_SPEED = values.full_leg_speed_rad_per_s;
/** Longest interpolation to a new target. */
export const MAX_TARGET_DURATION_US = values.max_target_duration_us;
