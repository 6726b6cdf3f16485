"""Programs that use a Bunraku server through its SDK. Each has a folder, a README and its own requirements."""
