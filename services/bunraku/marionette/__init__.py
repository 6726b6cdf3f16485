"""Pure: limbs on strings, and who holds them."""
