"""What is wrong with bytes that were to be a message."""


class MalformedMessage(ValueError):
    """A message of a known type that cannot be read; the text says what is wrong with it."""
