"""A crowd of viewers in a process of its own, told what to do: `python -m tests.bench.fanout_crowd URL [talk]`.

Each line of standard input is a command, answered with one JSON object: `join VIEWERS A_SECOND`, `count` (from here
on), `figures` (since then; beside a crowd's own, in milliseconds: `overlay_p99` and `overlay_max`, how late, and
`block_spread`, between the 5th and 95th of a hundred blocks that are due at once), `leave VIEWERS`. With `talk` they
say what viewers say, else only what WebSockets ask of them.
"""

from __future__ import annotations

import asyncio
import json
import sys
from typing import Any

import numpy as np
import uvloop

from bunraku.client.load_generator import LoadGenerator


async def run(url: str, quiet: bool) -> None:
    """Do what standard input says until its end."""
    crowd = LoadGenerator(url, single_reporter=quiet)
    while line := await asyncio.to_thread(sys.stdin.readline):
        command, *numbers = line.split()
        said: dict[str, Any] = {}
        if command == "join":
            await crowd.join(int(numbers[0]), float(numbers[1]))
        elif command == "leave":
            await crowd.leave(int(numbers[0]))
        elif command == "count":
            crowd.reset_statistics()
        else:
            late, blocks = np.array(crowd.state.overlay_lateness), np.array(crowd.state.block_lateness)
            said = crowd.statistics().as_json()
            if late.size:
                said |= {"overlay_p99": float(np.percentile(late, 99)) / 1e3, "overlay_max": float(late.max()) / 1e3}
            if blocks.size:
                said["block_spread"] = float(np.percentile(blocks, 95) - np.percentile(blocks, 5)) / 1e3
        print(json.dumps(said | {"joined": len(crowd.viewers), "refused": crowd.refused}), flush=True)


if __name__ == "__main__":
    uvloop.run(run(sys.argv[1], sys.argv[2:] != ["talk"]))
