"""Process of one attack: `python -m tests.attack.attacker NAME`.

The first line of standard input is the target as JSON. The process answers `ready`, starts at the next line, answers
each peak, and at the end prints its report as JSON. It ends by itself, also if the server never answers.
"""

from __future__ import annotations

import asyncio
import json
import os
import resource
import sys
from contextlib import suppress
from pathlib import Path

from tests.attack.registry import Report, Target, load_attacks

EXTRA_TIME_S = 40.0
"""Time for the end of an attack after its duration, seconds."""
MAX_FILES = 4_096
MAX_MEMORY_BYTES = 3 << 30
NICENESS = 10
"""Attackers give way to server and viewers: on a network they would not share processors with them."""


def main() -> None:
    function = load_attacks()[sys.argv[1]].function
    target = Target(**json.loads(sys.stdin.readline()))
    give_way()
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(MAX_FILES, hard), hard))
    cpu_seconds = int(target.seconds + EXTRA_TIME_S) * 2
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds))
    print(json.dumps({"event": "ready"}), flush=True)
    sys.stdin.readline()
    report = Report()

    async def run() -> None:
        async with asyncio.timeout(target.seconds + EXTRA_TIME_S):
            await function(target, report)

    try:
        asyncio.run(run())
    except Exception as error:
        report.violations.append(f"the attack failed: {type(error).__name__}: {error}")
    print(json.dumps({"event": "end", **report.as_json()}), flush=True)


def give_way() -> None:
    """Lower the priority of the process, also where Linux shares processors between sessions (autogroups)."""
    os.nice(NICENESS)
    with suppress(OSError):
        os.setsid()
        Path("/proc/self/autogroup").write_text(str(NICENESS))


if __name__ == "__main__":
    main()
