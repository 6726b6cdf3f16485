"""The stack that is verified: `docker compose` in a project of its own, so that no other stack is touched."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import time
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).parents[2]
OVERRIDE = Path(__file__).parent / "compose.yml"
PROJECT = "bunraku-verify"
_KILL_COMMAND = "kill -9 $(cat /proc/1/task/1/children)"
"""The first process ends with what it began: the container dies as by a fault, not by order, and is started anew."""
_COUNT_CONNECTIONS_COMMAND = "cat /proc/net/tcp /proc/net/tcp6 | awk '$2 ~ /:1F40$/ && $4 == \"01\"' | wc -l"


class CommandFailed(Exception):
    """A command of Docker's that did not do what it should; the text is what it said."""


class Stack:
    """The containers of one project; the gateway is at `url`."""

    def __init__(self, port: int) -> None:
        self.url = f"http://127.0.0.1:{port}"
        self._environment = {**os.environ, "BUNRAKU_PORT": str(port)}
        files = [word for file in (REPOSITORY / "docker-compose.yml", OVERRIDE) for word in ("--file", str(file))]
        self._compose = [
            "docker",
            "compose",
            "--ansi",
            "never",
            "--progress",
            "quiet",
            "--project-name",
            PROJECT,
            *files,
        ]

    async def compose(self, *arguments: str, stdin: bytes | None = None, seconds: float = 900.0) -> str:
        """What `docker compose` prints; raises `Failed`."""
        return await self._run([*self._compose, *arguments], stdin, seconds)

    async def up(self) -> float:
        """Build and start everything, from nothing; the seconds until all is healthy."""
        await self.down()
        began = time.monotonic()
        await self.compose("up", "--build", "--wait")
        return time.monotonic() - began

    async def down(self) -> None:
        """Stop everything, and keep nothing."""
        await self.compose("down", "--volumes", "--remove-orphans")

    async def kill(self, service: str, number: int = 1) -> None:
        """`kill -9` of a service's process; its container is started anew by itself."""
        with contextlib.suppress(CommandFailed):
            # who is killed takes the shell along
            await self.exec_in_replica(service, number, "sh", "-c", _KILL_COMMAND)

    async def restarts(self, service: str, number: int = 1) -> int:
        """How often a container was started anew by itself."""
        name = f"{PROJECT}-{service}-{number}"
        return int(await self._run(["docker", "inspect", "--format", "{{.RestartCount}}", name], None, 30.0))

    async def last_logged(self, service: str, number: int, text: str) -> str:
        """When a replica last said these words in its log, empty where it never did."""
        said = await self._run(["docker", "logs", "--timestamps", f"{PROJECT}-{service}-{number}"], None, 30.0)
        return max((line.partition(" ")[0] for line in said.splitlines() if text in line), default="")

    async def kill_all_replicas(self, service: str) -> None:
        """Kill a service, all of its replicas, and leave it so until `start`."""
        await self.compose("kill", "--signal", "KILL", service)

    async def stop_replica(self, service: str, number: int) -> None:
        """Stop one replica in order, and leave it so."""
        await self._run(["docker", "stop", f"{PROJECT}-{service}-{number}"], None, 60.0)

    async def exec_in_replica(self, service: str, number: int, *command: str, stdin: bytes | None = None) -> str:
        """What a command prints in a replica of a service."""
        words = ("exec", "-T", "--index", str(number), service, *command)
        return await self.compose(*words, stdin=stdin, seconds=60.0)

    async def count_connections(self, service: str, replicas: int = 2) -> list[int]:
        """The connections that each replica of a service has."""
        asked = (self.exec_in_replica(service, n + 1, "sh", "-c", _COUNT_CONNECTIONS_COMMAND) for n in range(replicas))
        return [int(said) for said in await asyncio.gather(*asked)]

    async def container_states(self) -> dict[str, str]:
        """Of each container whether it is healthy, or what else it is."""
        said = await self.compose("ps", "--all", "--format", "json")
        found: list[dict[str, Any]] = [json.loads(line) for line in said.splitlines() if line.startswith("{")]
        return {one["Name"].removeprefix(f"{PROJECT}-"): one["Health"] or one["State"] for one in found}

    async def wait_until_healthy(self, seconds: float = 120.0) -> float:
        """Wait until all are; the seconds that took."""
        began = time.monotonic()
        while True:
            states = await self.container_states()
            if set(states.values()) == {"healthy"}:
                return time.monotonic() - began
            if time.monotonic() - began > seconds:
                raise CommandFailed(f"not healthy after {seconds:g} s: {states}")
            await asyncio.sleep(0.3)

    async def image_megabytes(self) -> float:
        """Of the services' image."""
        said = await self._run(["docker", "image", "inspect", "--format", "{{.Size}}", "bunraku"], None, 30.0)
        return int(said) / 1e6

    async def _run(self, command: list[str], given: bytes | None, seconds: float) -> str:
        process = await asyncio.create_subprocess_exec(
            *command,
            stdin=asyncio.subprocess.PIPE if given is not None else asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
            env=self._environment,
            cwd=REPOSITORY,
        )
        try:
            async with asyncio.timeout(seconds):
                said, complained = await process.communicate(given)
        except BaseException:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
            raise
        if command[1] == "logs":
            said += complained
        if process.returncode != 0:
            raise CommandFailed(f"{' '.join(command[-6:])}: {complained.decode(errors='replace')[-2000:]}")
        return said.decode()
