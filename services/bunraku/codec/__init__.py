"""Codec: motion, camera, light and audio to independent blocks and back, and the container of stored motions. Pure."""
