"""Poses of the demo's choreography, by name: arms first, then whole bodies made of them.

The numbers of an `Arm`: position of the wrist (out, up, forward) from the shoulder in arm lengths, direction of the
elbow (out, up, forward), turn of the palm and bend of the hand in degrees.
"""

from __future__ import annotations

from dataclasses import replace

from bunraku.demo.score import Arm, Pose

ON_THIGH = Arm((0.10, -0.90, 0.30), (1.0, -0.2, -0.8), 10, 10)
BOWING = Arm((0.02, -0.80, 0.50), (1.0, -0.1, -0.6), 0, 10)
LOW_OPEN = Arm((0.62, -0.66, 0.28), (0.3, -0.3, -1.0), 50, -10)
LEVEL = Arm((0.95, 0.02, 0.22), (0.0, -0.6, -1.0), 70, -15)
HIGH = Arm((0.48, 0.82, 0.18), (0.9, -0.1, -0.5), 20, -15)
BEFORE_CHEST = Arm((0.02, -0.22, 0.66), (0.9, -0.6, -0.2), -10, 0)
CROSSED_OVER = Arm((-0.42, -0.02, 0.74), (0.9, -0.6, -0.1), -20, 5)
CROSSED_UNDER = Arm((-0.40, -0.44, 0.52), (0.9, -0.5, -0.1), -20, 5)
UPPER_FRONT = Arm((0.22, 0.10, 0.86), (0.8, -0.8, -0.1), 10, -10)
LOWER_FRONT = Arm((0.20, -0.48, 0.66), (0.9, -0.4, -0.3), 10, -10)
RAISED_FIST = Arm((0.60, 0.44, 0.16), (0.7, -0.7, -0.3), -30, 35)
SLEEVE_SHOWN = Arm((0.90, -0.18, 0.34), (0.0, -1.0, -0.4), 20, -30)
WING_UP = Arm((0.86, 0.46, 0.10), (0.1, -0.3, -1.0), 0, -30)
WING_DOWN = Arm((0.74, -0.52, 0.06), (0.4, 0.3, -1.0), 0, 25)
FAN_ABOVE = Arm((0.30, 0.90, 0.30), (1.0, 0.1, -0.3), 30, -25)
FAN_ASIDE = Arm((0.90, 0.22, 0.30), (0.0, -0.8, -0.7), 80, -25)
AT_HIP = Arm((0.34, -0.58, 0.10), (1.0, 0.0, -0.5), 0, 30)
TRAILING = Arm((0.84, -0.42, 0.26), (0.2, -0.6, -1.0), 30, -30)

STAND = Pose(ON_THIGH, ON_THIGH, depth=0.03)
NOD_OF_GREETING = Pose(BOWING, BOWING, depth=0.035, bow=28, nod=14)
DEEP_BOW = Pose(BOWING, BOWING, depth=0.05, bow=52, nod=18)
OPENING = Pose(LOW_OPEN, LOW_OPEN, depth=0.07, bow=4, nod=-4)
GATHERED = Pose(BEFORE_CHEST, BEFORE_CHEST, depth=0.08, bow=6, nod=6)
SWEEP_LEFT = Pose(LEVEL, BEFORE_CHEST, depth=0.08, bow=4, lean=6, twist=18, look=42, tilt=-4)
SWEEP_LEFT_NOD = replace(SWEEP_LEFT, nod=10, depth=0.10)
SWEEP_RIGHT = SWEEP_LEFT.mirror()
SLEEVES_WIDE = Pose(LEVEL, LEVEL, depth=0.06, bow=-3, nod=-5)
KNEE_RAISED = Pose(HIGH, AT_HIP, depth=0.05, bow=2, twist=-8, look=-20)
MIE_RIGHT = Pose(SLEEVE_SHOWN, RAISED_FIST, depth=0.20, bow=6, lean=6, twist=-14, look=-48, nod=-2, tilt=4)
MIE_ROLL = replace(MIE_RIGHT, look=-6, nod=14, tilt=14)
MIE_FRONT = replace(MIE_RIGHT, look=8, nod=-6, tilt=-5, depth=0.215)
BEFORE_CROSSING = Pose(UPPER_FRONT, LOWER_FRONT, depth=0.12, bow=8, nod=4)
CROSSED = Pose(CROSSED_OVER, CROSSED_UNDER, depth=0.10, bow=12, nod=12)
FANS = Pose(HIGH, HIGH, depth=0.05, bow=-5, nod=-12)
TURN_FAN = Pose(FAN_ASIDE, FAN_ABOVE, depth=0.07, lean=5, twist=10, look=12, tilt=4)
TURN_LOW = Pose(FAN_ABOVE, FAN_ASIDE, depth=0.08, lean=-5, twist=8, look=10, nod=6)
CROUCHED = Pose(WING_DOWN, WING_DOWN, depth=0.10, bow=12, nod=-4)
WINGS = Pose(WING_UP, WING_UP, depth=0.07, bow=6, nod=-6)
CIRCLING = Pose(SLEEVE_SHOWN, FAN_ABOVE, depth=0.08, bow=4, lean=-6, twist=-8, look=-12)
CIRCLING_WIDE = Pose(LEVEL, FAN_ASIDE, depth=0.09, bow=5, lean=-4, twist=-10, look=-10, nod=4)
LAST_KNEE = Pose(LEVEL, HIGH, depth=0.05, bow=2, twist=8, look=20)
LAST_MIE = Pose(FAN_ABOVE, TRAILING, depth=0.20, bow=5, lean=-8, twist=12, look=48, nod=-2, tilt=-4)
LAST_MIE_FRONT = replace(LAST_MIE, look=4, nod=-6, tilt=-8)
