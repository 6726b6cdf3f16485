"""Robot on the strings: a simulated humanoid follows a performer of a session.

python -m examples.robot --demo --show              a server of its own, two people who pull, 60 s
python -m examples.robot http://127.0.0.1:8000      the first session of a server, until Ctrl-C
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import signal
import sys
import tempfile
from pathlib import Path
from typing import Any

import httpx2

from bunraku.client import Client, ControlRefused, ServerProblem, StreamEnded
from examples.robot.rehearsal import demo_server, pull_strings

DEFAULT_SECONDS = 60.0
DEFAULT_BESIDE_M = 1.5


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the parsed command line; exit with an error if it is not valid."""
    parser = argparse.ArgumentParser(
        prog="python -m examples.robot", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("server", nargs="?", help="address of a server")
    parser.add_argument("session", nargs="?", help="id of a session; default: the first")
    parser.add_argument("--demo", action="store_true", help="start a server with the demo, and two people who pull")
    parser.add_argument(
        "--seconds", type=float, help=f"duration; default: {DEFAULT_SECONDS:g} with --demo, else endless"
    )
    parser.add_argument("--performer", type=int, default=0, help="number of the performer, from 0")
    parser.add_argument("--free", action="store_true", help="without strings: the robot falls and is set up again")
    parser.add_argument("--show", action="store_true", help="the robot dances beside the performer on everybody's page")
    parser.add_argument(
        "--beside", type=float, default=DEFAULT_BESIDE_M, help="distance for --show, metres; default: 1.5"
    )
    parser.add_argument("--token", default=os.environ.get("BUNRAKU_TOKEN"), help="access token; default: BUNRAKU_TOKEN")
    parser.add_argument("--json", action="store_true", help="figures at the end as one line of JSON")
    parsed = parser.parse_args(arguments)
    if parsed.demo == (parsed.server is not None):
        parser.error("give either the address of a server, or --demo")
    if parsed.seconds is not None and not 0 < parsed.seconds <= 86_400:
        parser.error("--seconds is above 0 and at most 86400")
    if parsed.performer < 0:
        parser.error("--performer is 0 or above")
    if parsed.seconds is None:
        parsed.seconds = DEFAULT_SECONDS if parsed.demo else 86_400.0
    return parsed


async def run_demo(seconds: float, options: dict[str, Any], *, quiet: bool = False) -> dict[str, Any]:
    """Run the robot on a server of its own while two people pull, and return the figures of the run."""
    with tempfile.TemporaryDirectory() as folder:
        async with demo_server(Path(folder)) as url, Client(url) as client:
            session = await client.first_session()
            assert session is not None, "the demo has a session"
            if not quiet:
                print(f"Watch it: {url}/?session={session}", flush=True)
            people = [asyncio.create_task(_pull(client, session, side)) for side in ("left", "right")]
            try:
                figures = await run_session(client, session, seconds, options, quiet=quiet)
            finally:
                for person in people:
                    person.cancel()
                ends = await asyncio.gather(*people, return_exceptions=True)
            # a run in which somebody could not pull shows nothing
            for end in ends:
                if isinstance(end, Exception):
                    raise end
            return figures


async def _pull(client: Client, session: str, side: str) -> None:
    await pull_strings(client, session, side, float("inf"))


async def run_session(
    client: Client, session: str, seconds: float, options: dict[str, Any], *, quiet: bool = False
) -> dict[str, Any]:
    """Let the robot follow a session and return the figures of the run; `options` are those of `run_robot`."""
    from examples.robot.stage import run_robot

    def report_fall(at: float) -> None:
        if not quiet:
            print(f"{at:6.1f} s  the robot fell, and was set up again", flush=True)

    stop, loop = asyncio.Event(), asyncio.get_running_loop()
    with contextlib.suppress(NotImplementedError, ValueError, RuntimeError):
        # not on Windows, and not outside of the main thread: there Ctrl-C ends without figures
        loop.add_signal_handler(signal.SIGINT, stop.set)
    robot = await run_robot(client, session, seconds, on_fall=report_fall, stop=stop, **options)
    return robot.measurement.summary()


async def run(parsed: argparse.Namespace) -> dict[str, Any]:
    """Run the command and return the figures."""
    options = {
        "performer": parsed.performer,
        "free": parsed.free,
        "beside": parsed.beside if parsed.show else None,
    }
    if parsed.demo:
        return await run_demo(parsed.seconds, options, quiet=parsed.json)
    async with Client(parsed.server.rstrip("/"), token=parsed.token) as client:
        session = parsed.session or await client.first_session()
        if session is None:
            sys.exit("The server has no open session. Open its page, or start it with --demo.")
        return await run_session(client, session, parsed.seconds, options, quiet=parsed.json)


def print_figures(figures: dict[str, Any]) -> None:
    """Print the figures of a run as a table."""
    broken = figures["joint_limits_broken"] + figures["torque_limits_broken"] + figures["unstable"]
    print(f"\n{figures['seconds']:.1f} s simulated, {figures['real_time_factor']} times as fast as real time")
    print(f"limits broken   {broken} in {figures['steps']} steps: joints {figures['joint_limits_broken']} (by more than"
          f" 0.5 degrees), torques {figures['torque_limits_broken']}, unstable {figures['unstable']}")  # fmt: skip
    print(f"falls           {figures['falls']}")
    print(f"pose error      {figures['pose_error_deg_p50']} degrees p50, {figures['pose_error_deg_p95']} p95")
    print(f"servo error     {figures['servo_error_deg_p50']} degrees p50, {figures['servo_error_deg_p95']} p95")
    print(f"root error      {figures['root_error_m_p95']} m p95")


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    parsed = parse_arguments(arguments)
    try:
        import mujoco  # noqa: F401
    except ImportError:
        sys.exit("MuJoCo is missing: python -m pip install -r examples/robot/requirements.txt")
    from examples.robot.stage import StageError

    try:
        figures = asyncio.run(run(parsed))
    except KeyboardInterrupt:
        sys.exit(130)
    except (StageError, ServerProblem, StreamEnded, ControlRefused, RuntimeError) as error:
        sys.exit(str(error))
    except (OSError, httpx2.TransportError) as error:
        sys.exit(f"The server cannot be reached: {error or type(error).__name__}")
    print(json.dumps(figures)) if parsed.json else print_figures(figures)


if __name__ == "__main__":
    main()
