"""Pure: messages to bytes and back."""
