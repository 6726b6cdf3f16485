"""Fault tests of the Compose stack: `make verify-compose`. The last line printed is one JSON object.

Needs Docker with Compose. The stack is built and started from this checkout as a separate project. A clip is uploaded,
watched by two viewers at different replicas, and controlled through a session replica that does not own the session.
Then each fault is injected the given number of times. The exit status is 1 if a check failed.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import sys
import tempfile
import time
from collections.abc import Coroutine
from pathlib import Path

from bunraku.client.api import Client
from tests.servers import make_bvh_clip
from tests.verify import live_fault, process_fault, upload_fault
from tests.verify.result import FaultResult
from tests.verify.scenario import PROBE_SOURCE, open_scenario
from tests.verify.stack import REPOSITORY, Stack

CLIP_PATH = "mocap/bvh/cmu_12_01_walk.bvh"


def main() -> None:
    """Parse the command line and run the fault tests."""
    parser = argparse.ArgumentParser(prog="make verify-compose", description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=5, help="repetitions of each fault")
    parser.add_argument(
        "--outage", type=float, default=30.0, help="duration of an outage of broker or database, seconds"
    )
    parser.add_argument("--port", type=int, default=8080)
    parser.add_argument(
        "--only", default="", help="run only faults whose names contain one of these words: kill,live,stop,gone,nats"
    )
    parser.add_argument("--keep", action="store_true", help="leave the stack running")
    options = parser.parse_args()
    sys.exit(asyncio.run(verify(options)))


async def verify(options: argparse.Namespace) -> int:
    """Start the stack, run all faults, print the results; return 1 if a check failed."""
    stack = Stack(options.port)
    rows: list[FaultResult] = []
    figures: dict[str, float] = {}
    try:
        figures["up_s"] = await stack.up()
        figures["image_mb"] = await stack.image_megabytes()
        with tempfile.TemporaryDirectory(prefix="bunraku-verify-") as name:
            await _run_faults(stack, options, Path(name), rows, figures)
    finally:
        if not options.keep:
            await stack.down()
    passed = sum(row.passed for row in rows)
    failed = sum(row.attempts for row in rows) - passed
    worst = {row.fault: {name: round(value, 4) for name, value in row.worst.items()} for row in rows}
    rounded = {name: round(value, 3) for name, value in figures.items()}
    print(", ".join(f"{name} {value:g}" for name, value in rounded.items()))
    print(json.dumps({"passed": passed, "failed": failed, **rounded, "rows": worst}))
    return int(failed > 0 or not rows)


async def _run_faults(
    stack: Stack, options: argparse.Namespace, folder: Path, rows: list[FaultResult], figures: dict[str, float]
) -> None:
    async with Client(stack.url) as client:
        began = time.monotonic()
        motion = (await client.upload(_select_clip(folder)))["id"]
        figures["upload_s"] = time.monotonic() - began
        demo = await client.first_session()
        assert demo is not None, "no session is open: the demo session is missing"
    bus_latency = json.loads(await stack.exec_in_replica("stream", 1, "python", "-", stdin=PROBE_SOURCE))
    figures |= {f"hop_{name}_ms": bus_latency[name] for name in ("p50", "p99")}
    async with open_scenario(stack, motion) as scenario:
        for viewer in scenario.viewers:
            assert viewer.statistics.first_pose_ms is not None
        figures["first_pose_ms"] = max(one.statistics.first_pose_ms or 0.0 for one in scenario.viewers)
        faults: list[tuple[str, Coroutine[None, None, FaultResult]]] = [
            *(
                (f"kill {name}", process_fault.kill_service(scenario, name, folder, options.rounds))
                for name in process_fault.KILL_TARGETS
            ),
            *(
                (f"live {name}", live_fault.kill_during_performance(scenario, name, options.rounds))
                for name in live_fault.TARGETS
            ),
            ("live capture", live_fault.kill_capture(scenario, _select_clip(folder), options.rounds)),
            ("full", upload_fault.fill_disk(scenario, options.rounds)),
            ("cut", upload_fault.interrupt_upload(scenario, options.rounds)),
            ("encoding", upload_fault.kill_while_encoding(scenario, options.rounds)),
            ("moved", process_fault.stop_one_stream_replica(scenario, options.rounds)),
            ("stop", process_fault.stop_stream_service(scenario, options.rounds)),
            *(
                (f"gone {name}", process_fault.run_outage(scenario, name, folder, options.rounds, options.outage))
                for name in ("nats", "postgres")
            ),
        ]
        for name, run in faults:
            if not any(word in name for word in options.only.split(",")):
                run.close()
                continue
            rows.append(await run)
            print(rows[-1].format_row(), flush=True)


def _select_clip(folder: Path) -> Path:
    """Return a recorded clip if there is one, else a generated one."""
    shared = Path(os.environ.get("BUNRAKU_SHARED") or REPOSITORY.parent / "shared") / CLIP_PATH
    if shared.is_file():
        return shared
    generated = folder / "made.bvh"
    generated.write_bytes(make_bvh_clip(20.0, 7))
    return generated


if __name__ == "__main__":
    main()
