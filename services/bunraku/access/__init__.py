"""Tickets for sockets, and links for viewers."""
