"""Progress of an upload."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

UploadStage = Literal["receiving", "preparing", "waiting", "reading", "encoding"]


@dataclass(slots=True)
class UploadProgress:
    """Stage of an upload and the completed share of that stage, 0..1.

    The share counts bytes while receiving and blocks while encoding. The server is preparing when it encodes for the
    first time on its machine. An upload is waiting while all worker slots are in use. These and reading have no share.
    If all takes of a file are stored, `take` is the number of the current one, from 1, of `takes`.
    """

    stage: UploadStage = "receiving"
    share: float = 0.0
    take: int = 1
    takes: int = 1

    def advance_to(self, stage: UploadStage, share: float = 0.0) -> None:
        """Set the current stage and share."""
        self.stage, self.share = stage, share

    def begin_take(self, take: int, takes: int) -> None:
        """Set the number of the current take."""
        self.take, self.takes = take, takes
