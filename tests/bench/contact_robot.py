"""Robot on the strings: limits and falls of the simulated humanoid of `examples/robot` while two people pull."""

from __future__ import annotations

import asyncio
import importlib.util
from typing import Any

from examples.robot.__main__ import print_figures, run_demo

SECONDS = 60.0
"""Duration of the run, seconds."""


def measure_robot(seconds: float = SECONDS) -> dict[str, Any]:
    """Print the figures of a robot that follows the demo on a server of its own, and return them.

    Without MuJoCo, return no figures.
    """
    if importlib.util.find_spec("mujoco") is None:
        print("robot: skipped, MuJoCo is not installed")
        return {}
    options = {"performer": 0, "free": False, "beside": 1.5}
    figures = asyncio.run(run_demo(seconds, options))
    print_figures(figures)
    broken = figures["joint_limits_broken"] + figures["torque_limits_broken"] + figures["unstable"]
    return {
        "robot_limits_broken": broken,
        "robot_falls": figures["falls"],
        "robot_seconds": figures["seconds"],
        "robot_pose_deg_p95": figures["pose_error_deg_p95"],
    }
