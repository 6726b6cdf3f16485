"""Those who watch a session, as one of them sees it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from bunraku.stream.block_batch import BlockBatchCache
from bunraku.stream.sync_group import SyncGroups

if TYPE_CHECKING:
    from bunraku.stream.viewer_connection import ViewerConnection


class ViewerGroup(Protocol):
    """All of one session, at one replica."""

    batches: BlockBatchCache
    sync_groups: SyncGroups

    def invalidate_writable(self) -> None:
        """Of one of them the line has room again, or no more."""

    def remove_viewer(self, viewer: ViewerConnection) -> None:
        """A viewer goes."""
