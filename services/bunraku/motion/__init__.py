"""Pure: rotations, the figure, readers and writers of motion capture, and the dance of our own."""
