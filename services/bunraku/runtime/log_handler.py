"""Log handler that never waits for the reader of the log."""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import threading
from typing import TextIO

MAX_WAITING_LINES = 10_000
"""Lines that wait for the reader of the log. Further ones are dropped and counted."""
MAX_WRITTEN_LINES = 256
"""Lines that are written at once."""
FLUSH_TIMEOUT_S = 1.0
"""Time that the waiting lines have at the end of the process, seconds."""


class BackgroundStreamHandler(logging.Handler):
    """Handler that writes lines to a stream on a thread.

    The stream of a service is a pipe to a container engine or a journal: if that reads slowly, a write blocks, and with
    it all clients of the process.
    """

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream
        self._descriptor: int | None = None
        with contextlib.suppress(OSError):
            self._descriptor = stream.fileno()
        self._waiting: queue.Queue[str | None] = queue.Queue(MAX_WAITING_LINES)
        self._dropped = 0
        self._writer = threading.Thread(target=self._write_waiting, name="log", daemon=True)
        self._writer.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Format a record and queue its line."""
        try:
            line = self.format(record)
            if self._dropped:
                line = f"{self._format_dropped(record)}\n{line}"
        except Exception:
            self.handleError(record)
            return
        try:
            self._waiting.put_nowait(f"{line}\n")
            self._dropped = 0
        except queue.Full:
            self._dropped += 1

    def flush(self) -> None:
        """Wait until the queued lines are written, for at most `FLUSH_TIMEOUT_S`."""
        done = self._waiting.all_tasks_done
        with done:
            done.wait_for(lambda: not self._waiting.unfinished_tasks, FLUSH_TIMEOUT_S)

    def close(self) -> None:
        """End the thread once the queued lines are written."""
        # a full queue is left to the end of the process, as the thread is a daemon
        with contextlib.suppress(queue.Full):
            self._waiting.put_nowait(None)
        super().close()

    def _format_dropped(self, record: logging.LogRecord) -> str:
        text = f"{self._dropped} lines were dropped, because the log is read too slowly"
        return self.format(logging.LogRecord(record.name, logging.WARNING, __file__, 0, text, None, None))

    def _write(self, text: str) -> None:
        if self._descriptor is None:
            self._stream.write(text)
            return
        # not through the stream: its lock, held by a blocked write, would break the end of the process
        data = text.encode(errors="backslashreplace")
        while data:
            data = data[os.write(self._descriptor, data) :]

    def _write_waiting(self) -> None:
        is_open = True
        while is_open:
            lines = [self._waiting.get()]
            while len(lines) < MAX_WRITTEN_LINES and not self._waiting.empty():
                lines.append(self._waiting.get_nowait())
            is_open = None not in lines
            # a closed stream: nobody reads the log any more
            with contextlib.suppress(OSError, ValueError):
                self._write("".join(line for line in lines if line is not None))
            for _ in lines:
                self._waiting.task_done()
