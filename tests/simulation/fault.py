"""Random faults of replicas, connections and disks."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from random import Random

from bunraku.client.reconnecting_connection import RETRY_INTERVAL_S, SILENCE_TIMEOUT_S
from bunraku.messaging.replica_registry import HEARTBEAT_INTERVAL_S, REPLICA_TIMEOUT_S
from tests.simulation.broker import BrokerClient
from tests.simulation.link import LinkQuality
from tests.simulation.model import Model
from tests.simulation.operation import Operations
from tests.simulation.replica import Replica
from tests.simulation.world import World

TAKEOVER_US = round((REPLICA_TIMEOUT_S + 2 * HEARTBEAT_INTERVAL_S + 1.5) * 1e6)
"""Time after the loss of a replica in which its sessions continue elsewhere."""
RESTART_US = 2_000_000
"""Time after the start of a replica in which clients use it."""
VIEWER_RECOVERY_US = round((SILENCE_TIMEOUT_S + 2 * RETRY_INTERVAL_S) * 1e6)
"""Time in which a viewer replaces a connection that it lost."""
SPLIT_US = round((2 * HEARTBEAT_INTERVAL_S + 0.5) * 1e6)
"""Time after a replica was cut off in which it may still run sessions that others have taken over."""
MAX_ANSWER_DELAY_US = 800_000
"""Delay of answers of the key-value store while it is slow."""
CLAIM_POLL_US = 5_000
"""Interval at which a claim is looked for that is to be disturbed."""
DIRECTIONS = {"both directions": (True, True), "to the broker": (True, False), "from the broker": (False, True)}
"""Directions of a connection that a partition cuts: up and down."""


class Faults:
    """Random faults; each knows when it and what it causes is over."""

    def __init__(self, world: World, model: Model, operations: Operations) -> None:
        self._world = world
        self._model = model
        self._operations = operations
        self._random: Random = world.random("faults")
        self.over_us = 0
        """Time at which all faults so far are over and what was lost has been replaced."""
        self._cut_off_until: dict[int, int] = {}
        faults: list[tuple[Callable[[], None], int]] = [
            (self.kill_replica, 4),
            (self.stop_replica, 2),
            (self.cut_replica, 5),
            (self.stop_broker, 1),
            (self.slow_link, 3),
            (self.cut_viewer, 2),
            (self.lose_messages, 2),
            (self.slow_disk, 2),
            (self.slow_store, 2),
            (self.disturb_takeover, 2),
        ]
        # each seed prefers other faults
        self._faults = [(fault, weight * self._random.choice((0, 1, 4))) for fault, weight in faults]
        self._faults.append((self.kill_replica, 1))

    def start_random(self) -> None:
        """Start a random fault."""
        faults, weights = zip(*self._faults, strict=True)
        self._random.choices(faults, weights)[0]()

    def was_cut_off(self, replica: Replica) -> bool:
        """Return whether a replica cannot know yet that others have taken over its sessions."""
        return self._world.loop.now_us < self._cut_off_until.get(id(replica.node), 0) + SPLIT_US

    def kill_replica(self) -> None:
        """Kill a replica and start it again."""
        replica, delay = self._choose_replica(), self._random.randrange(50_000, 2_500_000)
        if replica is not None:
            self._kill(replica, delay)

    def _kill(self, replica: Replica, delay: int) -> None:
        self._world.note(f"kill {replica.node.name} for {delay} us")
        replica.kill()
        self._last(max(delay + RESTART_US, TAKEOVER_US))
        self._later(delay, lambda: self._restart(replica))

    def stop_replica(self) -> None:
        """Stop a replica as at a rolling update and start it again."""
        replica, delay = self._choose_replica(), self._random.randrange(2_500_000, 3_500_000)
        if replica is None:
            return
        self._world.note(f"stop {replica.node.name} for {delay} us")
        replica.stop()
        self._last(delay + RESTART_US)
        self._later(delay, lambda: self._restart(replica))

    def cut_replica(self) -> None:
        """Cut a replica off from the broker."""
        replica, direction = self._choose_replica(), self._random.choice(tuple(DIRECTIONS))
        if replica is not None:
            self._cut([replica.bus], [replica], f"cut off {replica.node.name} ({direction})", direction)

    def stop_broker(self) -> None:
        """Cut all replicas off from the broker."""
        replicas = [replica for replica in self._world.replicas if replica.is_up]
        self._cut([replica.bus for replica in replicas], replicas, "stop the broker")

    def slow_link(self) -> None:
        """Delay the messages of a replica."""
        replica, duration = self._choose_replica(), self._random.randrange(200_000, 2_000_000)
        if replica is None:
            return
        links = (replica.bus.uplink, replica.bus.downlink)
        quality = LinkQuality(self._random.randrange(1_000, 120_000), self._random.randrange(0, 120_000))
        self._world.note(f"slow link of {replica.node.name} for {duration} us: {quality}")
        for link in links:
            link.quality = quality

        def restore() -> None:
            for link in links:
                link.quality = self._world.link_quality

        self._last(duration + 500_000)
        self._later(duration, restore)

    def cut_viewer(self) -> None:
        """Cut a viewer off from its server."""
        connected = [viewer.transport for viewer in self._model.viewers if viewer.transport is not None]
        if not connected:
            return
        transport, duration = self._random.choice(connected), self._random.randrange(100_000, 6_000_000)
        self._world.note(f"cut off a viewer for {duration} us")
        links = (transport.uplink, transport.downlink)
        for link in links:
            link.is_cut = True

        def heal() -> None:
            for link in links:
                link.heal()

        self._last(duration + VIEWER_RECOVERY_US)
        self._later(duration, heal)

    def lose_messages(self) -> None:
        """Let the bus lose and repeat overlays."""
        duration = self._random.randrange(200_000, 3_000_000)
        self._world.note(f"lose overlays for {duration} us")
        self._world.broker.loss = 0.2

        def restore() -> None:
            self._world.broker.loss = 0.0

        self._last(duration)
        self._later(duration, restore)

    def slow_disk(self) -> None:
        """Let each access to the disk take long."""
        duration, disk = self._random.randrange(200_000, 3_000_000), self._world.disk
        before = disk.max_access_us
        self._world.note(f"slow disk for {duration} us")
        disk.max_access_us = 250_000

        def restore() -> None:
            disk.max_access_us = min(before, 2_000)

        self._last(duration + 1_500_000)
        self._later(duration, restore)

    def slow_store(self) -> None:
        """Let the answers of the key-value store be late."""
        duration, broker = self._random.randrange(200_000, 3_000_000), self._world.broker
        self._world.note(f"slow key-value store for {duration} us")
        broker.max_answer_delay_us = MAX_ANSWER_DELAY_US

        def restore() -> None:
            broker.max_answer_delay_us = 0

        self._last(duration + MAX_ANSWER_DELAY_US + TAKEOVER_US)
        self._later(duration, restore)

    def disturb_takeover(self) -> None:
        """Kill the owner of sessions; once one is claimed, kill the claimant too, or end or edit the session."""
        owners = [replica for replica in self._world.sessions if replica.is_up and replica.sessions.stages]
        if owners:
            self._kill(self._random.choice(owners), self._random.randrange(50_000, 2_500_000))
            self._await_claim(self._world.loop.now_us + TAKEOVER_US)

    def _await_claim(self, until_us: int) -> None:
        for replica in self._world.sessions:
            for task in sorted(task.get_name() for task in replica.sessions._claim_tasks):
                if replica.is_up:
                    self._disturb_claim(replica, task.removeprefix("claim session "))
                    return
        if self._world.loop.now_us < until_us:
            self._later(CLAIM_POLL_US, lambda: self._await_claim(until_us))

    def _disturb_claim(self, claimant: Replica, session: str) -> None:
        disturbance = self._random.choice(("kill", "end", "edit"))
        self._world.note(f"{disturbance} while {claimant.node.name} claims {session}")
        if disturbance == "kill":
            self._kill(claimant, self._random.randrange(50_000, 2_500_000))
        elif session in self._model.open_sessions():
            operation = self._operations.end_session if disturbance == "end" else self._operations.edit
            self._operations.start(partial(operation, session))

    def _cut(
        self, clients: list[BrokerClient], replicas: list[Replica], name: str, direction: str = "both directions"
    ) -> None:
        duration = self._random.randrange(50_000, 4_500_000)
        self._world.note(f"{name} for {duration} us")
        for client in clients:
            client.cut(*DIRECTIONS[direction])
        for replica in replicas:
            until = self._world.loop.now_us + duration
            self._cut_off_until[id(replica.node)] = max(until, self._cut_off_until.get(id(replica.node), 0))

        def heal() -> None:
            for client in clients:
                client.heal()

        self._last(duration + TAKEOVER_US)
        self._later(duration, heal)

    def _restart(self, replica: Replica) -> None:
        if replica.node.is_alive and replica.is_stopping:
            replica.kill()
        if not replica.node.is_alive:
            replica.start()
            self._world.note(f"start {replica.node.name}")

    def _choose_replica(self) -> Replica | None:
        replicas = [replica for replica in self._world.replicas if replica.is_up]
        return self._random.choice(replicas) if replicas else None

    def _last(self, duration_us: int) -> None:
        self.over_us = max(self.over_us, self._world.loop.now_us + duration_us)

    def _later(self, delay_us: int, function: Callable[[], None]) -> None:
        self._world.loop.call_later(delay_us * 1e-6, function)
