"""One simulation: a random scenario with faults, then quiet, then the final checks."""

from __future__ import annotations

import asyncio
import gc
import tempfile
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from bunraku.storage.migration import migrate
from tests.simulation.fault import Faults
from tests.simulation.invariant import Invariants
from tests.simulation.library import Library, load_library
from tests.simulation.model import Model
from tests.simulation.operation import LIMB_COUNT, Operations
from tests.simulation.world import Violation, World

FAULT_PHASE_US = 2_000_000
"""Time in which faults begin."""
OPERATION_INTERVALS_US = (40_000, 80_000, 160_000)
FAULT_INTERVALS_US = (300_000, 600_000, 1_200_000)
"""Mean time between two operations, and between two faults; one for each seed."""
CONVERGENCE_US = 1_000_000
"""Time after the end of all faults in which every viewer shows the same pose."""
CLAIM_US = 400_000
"""Time in which a puppeteer gets a free limb once all faults are over."""
STOP_US = 4_500_000
"""Time in which a replica stops, with a job or a request that waits for its timeout."""

Mutation = Callable[[], AbstractContextManager[object]]


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of one simulation."""

    seed: int
    violation: str | None
    trace: list[str]
    steps: int
    virtual_us: int


@cache
def _migrated_database() -> Path:
    path = Path(tempfile.mkdtemp(prefix="bunraku-simulation-")) / "catalogue.sqlite"
    migrate(f"sqlite+aiosqlite:///{path}")
    return path


def simulate(seed: int, mutation: Mutation = nullcontext) -> Outcome:
    """Run the simulation of a seed, with a deliberate fault of the code if `mutation` is given."""
    library, database = load_library(), _migrated_database()
    # collection depends on what ran before
    gc.disable()
    try:
        return _simulate(seed, mutation, library, database)
    finally:
        gc.enable()


def _simulate(seed: int, mutation: Mutation, library: Library, database: Path) -> Outcome:
    with tempfile.TemporaryDirectory(prefix="bunraku-simulation-") as folder:
        world = World(seed, library, Path(folder), database)
        scenario = _Scenario(world)
        with world.installed(), mutation():
            violation = scenario.run()
    return Outcome(seed, violation, world.trace, scenario.steps, world.loop.now_us)


class _Scenario:
    def __init__(self, world: World) -> None:
        self.steps = 0
        self._world = world
        self._model = Model()
        self._operations = Operations(world, self._model)
        self._faults = Faults(world, self._model, self._operations)
        self._invariants = Invariants(world, self._model, self._faults)
        self._random = world.random("scenario")

    def run(self) -> str | None:
        """Run the scenario and return the violated invariant, if any."""
        loop = self._world.loop
        loop.after_step = self._after_step
        try:
            loop.run_until_complete(self._run())
        except Violation as violation:
            self._world.note(f"VIOLATION {violation}")
            return str(violation)
        finally:
            loop.after_step = lambda: None
            self._close()
        return None

    def _after_step(self) -> None:
        self.steps += 1
        self._invariants.check_step()

    async def _run(self) -> None:
        random = self._random
        self._world.start_replicas(random.randint(2, 3), 2, random.choice((0, 0, 1, 2)))
        for start in (self._operations.open_session, self._operations.open_session):
            self._operations.start(start)
        await self._sleep(300_000)
        for start in (self._operations.join_viewer, self._operations.join_puppeteer, self._operations.join_puppeteer):
            self._operations.start(start)
        await self._cause_trouble()
        # most seeds recover without held limbs, which cost most of the time of a simulation
        if random.random() < 0.8:
            self._release_all()
        await self._wait_for_recovery()
        await self._operations.finish()
        await self._wait_for_recovery()
        self._world.note("all faults are over")
        converged_us = self._world.loop.now_us + CONVERGENCE_US
        for puppeteer in self._model.puppeteers:
            puppeteer.is_moving = True
            puppeteer.claim(random.randrange(LIMB_COUNT))
        await self._sleep(CONVERGENCE_US // 4)
        # a viewer on a constrained link is not sent every overlay of a limb that moves
        for puppeteer in self._model.puppeteers:
            puppeteer.is_moving = False
        await self._sleep(CONVERGENCE_US // 2)
        await self._invariants.check_end(converged_us)
        await self._check_claims()
        await self._stop()

    async def _cause_trouble(self) -> None:
        """Start random operations and faults."""
        world, random = self._world, self._random
        operation_us, fault_us = random.choice(OPERATION_INTERVALS_US), random.choice(FAULT_INTERVALS_US)
        next_fault = world.loop.now_us + self._interval(fault_us)
        end = world.loop.now_us + FAULT_PHASE_US
        while world.loop.now_us < end:
            await self._sleep(self._interval(operation_us))
            self._operations.start_random()
            if world.loop.now_us >= next_fault:
                self._faults.start_random()
                next_fault = world.loop.now_us + self._interval(fault_us)

    async def _wait_for_recovery(self) -> None:
        """Wait until all faults and what they cause are over; one fault may cause another."""
        while (remaining_us := self._faults.over_us - self._world.loop.now_us) > 0:
            await self._sleep(remaining_us)

    def _release_all(self) -> None:
        for puppeteer in self._model.puppeteers:
            for limb in range(LIMB_COUNT):
                puppeteer.ask(limb, False)
                puppeteer.release(limb)

    async def _check_claims(self) -> None:
        """Let every puppeteer claim a limb that is free."""
        # twice: a limb that is released goes to a puppeteer who has asked for it
        for _ in range(2):
            self._release_all()
            await self._sleep(CLAIM_US)
        free = {
            stage.id: [limb for limb, holder in enumerate(stage.holders) if holder is None]
            for replica in self._world.sessions
            for stage in replica.sessions.stages
        }
        expected = []
        for puppeteer in self._model.puppeteers:
            if puppeteer.session in self._model.open_sessions():
                if not free[puppeteer.session]:
                    raise Violation(f"session {puppeteer.session} has no free limb, but all were released")
                limb = free[puppeteer.session].pop()
                puppeteer.claim(limb)
                expected.append((puppeteer, limb))
        await self._sleep(CLAIM_US)
        for puppeteer, limb in expected:
            if limb not in puppeteer.epochs:
                raise Violation(f"{puppeteer.node.name} cannot claim the free limb {limb} of {puppeteer.session}")

    async def _stop(self) -> None:
        """Stop everything; raise `Violation` if a process leaves a task behind."""
        for viewer in self._model.viewers:
            await viewer.leave()
        for puppeteer in self._model.puppeteers:
            await puppeteer.leave()
        for replica in self._world.replicas:
            if replica.is_up:
                replica.stop()
        await self._sleep(STOP_US)
        left = [name for replica in self._world.replicas for name in replica.left_tasks]
        if left:
            raise Violation(f"tasks are left at the end of their process: {left}")

    async def _sleep(self, duration_us: int) -> None:
        await asyncio.sleep(duration_us * 1e-6)
        for task in tuple(self._operations.running):
            if task.done():
                task.result()

    def _interval(self, mean_us: int) -> int:
        return min(int(self._random.expovariate(1 / mean_us)), 4 * mean_us)

    def _close(self) -> None:
        """Release what is left of the simulation, without any effect."""
        loop = self._world.loop
        for replica in self._world.replicas:
            if replica.node.is_alive:
                replica.kill()
        tasks = sorted(asyncio.all_tasks(loop), key=lambda task: task.get_name())
        for task in tasks:
            task.cancel()
        if tasks:
            loop.run_until_complete(asyncio.wait(tasks, timeout=60.0))
        self._world.databases.close_all()
        loop.run_until_complete(loop.shutdown_asyncgens())
        loop.close()
