"""Commands that change the limbs of a stage, and the interface of their recorder."""

from __future__ import annotations

from enum import IntEnum
from typing import Protocol


class CommandKind(IntEnum):
    """Kind of a recorded command; the numbers are those of the input log.

    The note after each member names the values that follow kind and clock time.
    """

    CLAIM = 0
    """puppeteer, limb"""
    RELEASE = 1
    """puppeteer, limb, epoch"""
    LEAVE = 2
    """puppeteer"""
    KEEP_ALIVE = 3
    """puppeteer, bit mask of limbs"""
    INPUT = 4
    """puppeteer, limb, kind, epoch, sequence, sample time, three values"""
    ASK = 5
    """puppeteer, limb, True to ask or False to withdraw"""
    GRANT_FREE_LIMBS = 6
    EXPIRE = 7
    OBSERVE = 8
    """clock time of the poses"""
    OVERLAY = 9
    """clock time of the poses"""
    FIGURES = 10
    """motion"""


class CommandRecorder(Protocol):
    """Receiver of the commands of a stage, in the order in which they are applied. Times are clock time in µs."""

    def begin_segment(self, epochs: tuple[int, ...], now: int) -> None:
        """Begin a segment: all limbs are at rest with these epochs of their last grants, and a command follows."""

    def append(self, kind: CommandKind, now: int, *values: str | float) -> None:
        """Record a command."""

    def change_motion(self, motion: str) -> None:
        """Name the motion of the segments that begin from now on."""
