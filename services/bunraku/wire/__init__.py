"""Messages of `bunraku.v1` to bytes and back (proto/messages.md). Pure."""
