"""The stack under test: `docker compose` with a separate project, so that no other stack is touched."""

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
"""Kills the service below the init process, which ends with it: the container fails and is restarted."""
_COUNT_CONNECTIONS_COMMAND = "cat /proc/net/tcp /proc/net/tcp6 | awk '$2 ~ /:1F40$/ && $4 == \"01\"' | wc -l"


class CommandFailed(Exception):
    """A failed command of Docker; the text is its output."""


class Stack:
    """Containers of one project; the gateway is at `url`."""

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
        """Run `docker compose`; return its output or raise `CommandFailed`."""
        return await self._run([*self._compose, *arguments], stdin, seconds)

    async def up(self) -> float:
        """Build and start the stack from nothing; return the seconds until it is healthy."""
        await self.down()
        began = time.monotonic()
        await self.compose("up", "--build", "--wait")
        return time.monotonic() - began

    async def down(self) -> None:
        """Stop the stack and remove its volumes."""
        await self.compose("down", "--volumes", "--remove-orphans")

    async def kill(self, service: str, number: int = 1) -> None:
        """Kill a service's process with `kill -9`; its container restarts by itself."""
        with contextlib.suppress(CommandFailed):
            # the shell is killed with the process
            await self.exec_in_replica(service, number, "sh", "-c", _KILL_COMMAND)

    async def restarts(self, service: str, number: int = 1) -> int:
        """Return how often a container was restarted."""
        name = f"{PROJECT}-{service}-{number}"
        return int(await self._run(["docker", "inspect", "--format", "{{.RestartCount}}", name], None, 30.0))

    async def last_logged(self, service: str, number: int, text: str) -> str:
        """Return the time at which a replica last logged a text, empty if never."""
        output = await self._run(["docker", "logs", "--timestamps", f"{PROJECT}-{service}-{number}"], None, 30.0)
        return max((line.partition(" ")[0] for line in output.splitlines() if text in line), default="")

    async def kill_all_replicas(self, service: str) -> None:
        """Kill all replicas of a service, without restart until `start`."""
        await self.compose("kill", "--signal", "KILL", service)

    async def stop_replica(self, service: str, number: int) -> None:
        """Stop one replica in order, without restart."""
        await self._run(["docker", "stop", f"{PROJECT}-{service}-{number}"], None, 60.0)

    async def exec_in_replica(self, service: str, number: int, *command: str, stdin: bytes | None = None) -> str:
        """Run a command in a replica of a service and return its output."""
        arguments = ("exec", "-T", "--index", str(number), service, *command)
        return await self.compose(*arguments, stdin=stdin, seconds=60.0)

    async def count_connections(self, service: str, replicas: int = 2) -> list[int]:
        """Return the number of connections of each replica of a service."""
        counts = (self.exec_in_replica(service, n + 1, "sh", "-c", _COUNT_CONNECTIONS_COMMAND) for n in range(replicas))
        return [int(output) for output in await asyncio.gather(*counts)]

    async def container_states(self) -> dict[str, str]:
        """Return the health of each container, or its state if it has no health check."""
        output = await self.compose("ps", "--all", "--format", "json")
        found: list[dict[str, Any]] = [json.loads(line) for line in output.splitlines() if line.startswith("{")]
        return {one["Name"].removeprefix(f"{PROJECT}-"): one["Health"] or one["State"] for one in found}

    async def wait_until_healthy(self, seconds: float = 120.0) -> float:
        """Wait until all containers are healthy; return the seconds that took."""
        began = time.monotonic()
        while True:
            states = await self.container_states()
            if set(states.values()) == {"healthy"}:
                return time.monotonic() - began
            if time.monotonic() - began > seconds:
                raise CommandFailed(f"not healthy after {seconds:g} s: {states}")
            await asyncio.sleep(0.3)

    async def image_megabytes(self) -> float:
        """Return the size of the image of the services, MB."""
        output = await self._run(["docker", "image", "inspect", "--format", "{{.Size}}", "bunraku"], None, 30.0)
        return int(output) / 1e6

    async def _run(self, command: list[str], stdin: bytes | None, seconds: float) -> str:
        process = await asyncio.create_subprocess_exec(
            *command,
            stdin=asyncio.subprocess.PIPE if stdin is not None else asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
            env=self._environment,
            cwd=REPOSITORY,
        )
        try:
            async with asyncio.timeout(seconds):
                output, errors = await process.communicate(stdin)
        except BaseException:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
            raise
        if command[1] == "logs":
            output += errors
        if process.returncode != 0:
            raise CommandFailed(f"{' '.join(command[-6:])}: {errors.decode(errors='replace')[-2000:]}")
        return output.decode()
