"""Server-side WebSocket connections: framing, hand-off from ASGI, TCP state, multicast."""
