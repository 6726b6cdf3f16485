"""Pure: what to show and what to send, and when."""
