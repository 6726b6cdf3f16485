"""Error of the message decoder."""


class MalformedMessage(ValueError):
    """A message of a known type that breaks the format; the text names the type, the field and the rule."""
