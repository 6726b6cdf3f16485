"""Codec of extensions: further joints, fingers, faces and foot contacts of performers (proto/codec.md, 2.17-2.20)."""
