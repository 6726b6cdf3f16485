"""Server-side WebSocket connections: framing, hand-off from ASGI, link state, multicast."""
