"""Receiver of a stream: clock estimation, timeline, play-out delay, stores of blocks and overlays. Pure."""
