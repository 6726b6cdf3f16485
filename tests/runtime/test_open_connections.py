from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.runtime.open_connections import OpenConnections


class Connection:
    def __init__(self, source: str) -> None:
        self.source = source
        self.is_aborted = False

    def abort(self) -> None:
        self.is_aborted = True


def test_address_with_the_most_connections_makes_room() -> None:
    connections = OpenConnections(10)
    viewers = [Connection(f"viewer {number}") for number in range(3)]
    flood = [Connection("flood") for _ in range(50)]
    for connection in (*viewers[:2], *flood):
        connections.add(connection)
    # those that are open stay, new ones are refused
    assert [connection.is_aborted for connection in flood] == [False] * 8 + [True] * 42
    connections.add(viewers[2])
    assert not any(viewer.is_aborted for viewer in viewers)
    assert flood[7].is_aborted
    assert len(connections) == 10


@pytest.mark.parametrize("remove", [OpenConnections.discard, OpenConnections.remove])
def test_removed_connection_makes_room_once(remove: Callable[[OpenConnections, Connection], None]) -> None:
    connections = OpenConnections(2)
    first, second = Connection("a"), Connection("a")
    connections.add(first)
    connections.add(second)
    remove(connections, first)
    remove(connections, first)
    connections.add(Connection("a"))
    assert not second.is_aborted
    assert len(connections) == 2


@pytest.mark.parametrize("remove", [OpenConnections.discard, OpenConnections.remove])
def test_removed_connections_do_not_count_for_their_address(
    remove: Callable[[OpenConnections, Connection], None],
) -> None:
    connections = OpenConnections(2)
    for _ in range(3):
        ended = Connection("a")
        connections.add(ended)
        remove(connections, ended)
    present = [Connection("b") for _ in range(3)]
    for connection in present:
        connections.add(connection)
    assert [connection.is_aborted for connection in present] == [False, False, True]


@given(st.lists(st.tuples(st.sampled_from("abc"), st.booleans()), max_size=60))
def test_set_never_exceeds_its_capacity(steps: list[tuple[str, bool]]) -> None:
    connections = OpenConnections(5)
    added: list[Connection] = []
    for source, adds in steps:
        if adds or not added:
            added.append(Connection(source))
            connections.add(added[-1])
        else:
            connections.discard(added.pop())
        assert len(connections) <= 5
        assert not any(connection.is_aborted for connection in connections)
