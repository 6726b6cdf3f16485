"""Pure: channels to blocks and back."""
