"""Small BVH texts for tests: two joints of nine channels, two frames."""

HIERARCHY_TEXT = b"""HIERARCHY
ROOT Hips
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 10.5 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 20 0
    }
  }
}
"""
MOTION_LINE = 16
FIRST_FRAME_LINE = 19
ROWS = (b"1 2 3 4 5 6 7 8 9.5", b"-1 -2 -3 -4 -5 -6 -7 -8 -9.5")
VALUES = [[float(word) for word in row.split()] for row in ROWS]


def motion_section(*rows: bytes, frames: bytes = b"Frames: 2", time: bytes = b"Frame Time: 0.04") -> bytes:
    return b"\n".join([b"MOTION", frames, time, *(rows or ROWS)]) + b"\n"


MINIMAL_BVH = HIERARCHY_TEXT + motion_section()
