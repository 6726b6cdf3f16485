import { expect, test } from "vitest";
import { pictureSize } from "../../../src/stage/rendering/picture";

test.each([
  ["a wide stage is twice as sharp", [1920, 1080], [3840, 2160]],
  ["a small one as wide as a picture is at least", [760, 560], [1600, 1179]],
  ["a phone's too", [390, 844], [1600, 3463]],
  ["nothing is larger than a picture can be", [2560, 1440], [4096, 2304]],
  ["nor higher", [320, 1200], [1092, 4096]],
])("%s", (_, [width, height], [wide, high]) =>
  expect(pictureSize(width, height)).toEqual({ width: wide, height: high }),
);
