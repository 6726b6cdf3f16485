"""The Python SDK: `api.Client` uploads and lists, `viewer.Viewer` watches, `puppeteer.Puppeteer` pulls,
`one_euro.OneEuro` steadies what pulls.

Names are imported where they are first used: listing motions need not load a decoder.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bunraku.client.api import Client, ServerProblem
    from bunraku.client.one_euro import OneEuro
    from bunraku.client.puppeteer import ControlRefused, Puppeteer
    from bunraku.client.reconnecting_connection import StreamEnded
    from bunraku.client.viewer import Viewer
    from bunraku.client.viewer_statistics import ViewerStatistics

_HOMES = {
    "Client": "api",
    "ControlRefused": "puppeteer",
    "OneEuro": "one_euro",
    "Puppeteer": "puppeteer",
    "ServerProblem": "api",
    "StreamEnded": "reconnecting_connection",
    "Viewer": "viewer",
    "ViewerStatistics": "viewer_statistics",
}
__all__ = [
    "Client",
    "ControlRefused",
    "OneEuro",
    "Puppeteer",
    "ServerProblem",
    "StreamEnded",
    "Viewer",
    "ViewerStatistics",
]


def __getattr__(name: str) -> Any:
    """The class of this name, from the module it lives in."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
