"""Sender of a stream: scheduler, congestion window, adaptive bitrate, prefetch, resume."""
