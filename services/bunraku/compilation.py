"""First compilation of the kernels on a machine.

It takes a processor one to two minutes. The server compiles in a process of its own while it serves: limbs are solved
in Python meanwhile, and uploads wait.
"""

from __future__ import annotations

import asyncio
import logging
import os
import sys
from asyncio.subprocess import DEVNULL, PIPE

COMPILATION_TIMEOUT_S = 900
"""Time after which the compilation is ended: each process then compiles what it uses."""
_COMPILE = "import os; hasattr(os, 'nice') and os.nice(10); from bunraku.cli import app; app(['warm'])"

_log = logging.getLogger(__name__)


async def compile_kernels() -> None:
    """Compile all kernels in another process, which keeps them for all others; log if it fails."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("BUNRAKU_")}
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", _COMPILE, stdin=DEVNULL, stdout=DEVNULL, stderr=PIPE, env=environment
    )
    try:
        async with asyncio.timeout(COMPILATION_TIMEOUT_S):
            _, output = await process.communicate()
    except TimeoutError:
        _log.warning("the compilation of the kernels did not end within %g s", COMPILATION_TIMEOUT_S)
    else:
        if process.returncode:
            _log.warning("the kernels could not be compiled: %s", output.decode(errors="replace")[-2000:])
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
