"""Registry of the attacks: what each one does, which row of docs/security.md it tests, and what counts as held."""

from __future__ import annotations

import asyncio
import json
import sys
from collections import Counter
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

SOURCE_ADDRESSES = "127.0.66"
"""First three bytes of the addresses from which attackers connect, so that limits per address do not hit viewers."""
MAX_RSS_GROWTH_MB = 50.0
"""Growth of the server's memory that an attack may cause."""


@dataclass(frozen=True)
class Target:
    """Server under attack, and the attacker's credentials.

    `tokens` are those of the attacker by role: `view`, `control`, `ingest`; others are named by their defect. `seconds`
    is the duration of the attack. `source` is the first three bytes of the addresses to connect from, empty for the
    default of the system.
    """

    host: str
    port: int
    session: str
    motion: str
    tokens: dict[str, str]
    seconds: float
    source: str = SOURCE_ADDRESSES

    @property
    def is_behind_gateway(self) -> bool:
        """True if a gateway parses the requests first."""
        return not self.source

    @property
    def stream(self) -> str:
        """Path of the stream of the controlled session."""
        return f"/v1/sessions/{self.session}/stream"

    @property
    def control(self) -> str:
        """Path of the control connection of the controlled session."""
        return f"/v1/sessions/{self.session}/control"

    @property
    def motion_stream(self) -> str:
        """Path of a stream with a private timeline."""
        return f"/v1/motions/{self.motion}/stream"


@dataclass
class Report:
    """Observations of an attacker: counted answers, and violations of the contract."""

    answers: Counter[str] = field(default_factory=Counter)
    violations: list[str] = field(default_factory=list)

    def count(self, answer: str, number: int = 1) -> None:
        """Count an answer of the server."""
        self.answers[answer] += number

    def require(self, condition: object, violation: str) -> None:
        """Record a violation unless `condition` is true."""
        if not condition and violation not in self.violations:
            self.violations.append(violation)

    async def reach_peak(self) -> None:
        """Report the peak of the attack to the runner, and wait until it has tried to use the server."""
        print(json.dumps({"event": "peak"}), flush=True)
        # the attack goes on meanwhile
        await asyncio.to_thread(sys.stdin.readline)

    def as_json(self) -> dict[str, Any]:
        """Return the report as plain values."""
        return {"answers": dict(self.answers), "violations": self.violations}


AttackFunction = Callable[[Target, Report], Awaitable[None]]


@dataclass(frozen=True)
class Attack:
    """Attack of a hostile client, which runs in a separate process.

    `row` is the row of the table in docs/security.md, `criterion` the requirement. `seconds` is the minimum duration of
    a full run, 0 for that of the command line. `probe` names what another subject does at the peak of the attack
    (`tests.attack.probe`). `is_quick` attacks also run in the test suite.
    """

    name: str
    row: int
    criterion: str
    function: AttackFunction
    seconds: float
    probe: str
    is_quick: bool
    max_rss_growth_mb: float


ATTACKS: dict[str, Attack] = {}


def attack(
    row: int,
    criterion: str,
    *,
    seconds: float = 0.0,
    probe: str = "",
    quick: bool = False,
    max_rss_growth_mb: float = MAX_RSS_GROWTH_MB,
) -> Callable[[AttackFunction], AttackFunction]:
    """Register a function as an attack. Its name is that of the function; its docstring describes it."""

    def register(function: AttackFunction) -> AttackFunction:
        name = function.__name__.replace("_", " ")
        assert name not in ATTACKS, f"two attacks have the name {name!r}"
        ATTACKS[name] = Attack(name, row, criterion, function, seconds, probe, quick, max_rss_growth_mb)
        return function

    return register


def load_attacks() -> dict[str, Attack]:
    """Import all modules with attacks and return the attacks by name, in the order of their rows."""
    from tests.attack import (  # noqa: F401 - importing them registers the attacks
        attack_access,
        attack_body,
        attack_control,
        attack_credential,
        attack_file,
        attack_flow,
        attack_frames,
        attack_http,
        attack_page,
        attack_performer,
        attack_reader,
        attack_request,
        attack_request_flood,
        attack_socket,
        attack_upload,
    )

    return dict(sorted(ATTACKS.items(), key=lambda item: item[1].row))
