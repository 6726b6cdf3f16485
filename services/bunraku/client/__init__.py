"""Python SDK: `Client` (HTTP), `Viewer` (watch), `Puppeteer` (control limbs), `Performer` (perform live), `OneEuro`.

Names are imported at their first use, so that listing motions does not load a decoder.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bunraku.client.api import Client
    from bunraku.client.one_euro import OneEuro
    from bunraku.client.performer import Performer
    from bunraku.client.puppeteer import ControlRefused, Puppeteer
    from bunraku.client.reconnecting_connection import StreamEnded
    from bunraku.client.server_problem import ServerProblem
    from bunraku.client.viewer import Viewer
    from bunraku.client.viewer_statistics import ViewerStatistics

_HOMES = {
    "Client": "api",
    "ControlRefused": "puppeteer",
    "OneEuro": "one_euro",
    "Performer": "performer",
    "Puppeteer": "puppeteer",
    "ServerProblem": "server_problem",
    "StreamEnded": "reconnecting_connection",
    "Viewer": "viewer",
    "ViewerStatistics": "viewer_statistics",
}
__all__ = [
    "Client",
    "ControlRefused",
    "OneEuro",
    "Performer",
    "Puppeteer",
    "ServerProblem",
    "StreamEnded",
    "Viewer",
    "ViewerStatistics",
]


def __getattr__(name: str) -> Any:
    """Import a class of the SDK from its module."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
