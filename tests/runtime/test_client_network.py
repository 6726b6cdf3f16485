from __future__ import annotations

import pytest

from bunraku.runtime.client_network import client_network


@pytest.mark.parametrize(
    ("address", "network"),
    [
        ("192.0.2.7", "192.0.2.7"),
        ("::ffff:192.0.2.7", "192.0.2.7"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::"),
        ("2001:db8:1:2:ffff::1", "2001:db8:1:2::"),
        ("a pipe", "a pipe"),
    ],
)
def test_client_network_groups_ipv6_addresses(address: str, network: str) -> None:
    assert client_network(address) == network
