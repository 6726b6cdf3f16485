"""Pure: music of our own for the dance, from notes to samples."""
