"""Access service: tickets for WebSockets, and links for viewers."""
