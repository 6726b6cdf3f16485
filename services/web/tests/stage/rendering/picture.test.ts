import { expect, test } from "vitest";
import { pictureSize } from "../../../src/stage/rendering/picture";

test.each([
  ["a wide stage gets twice its resolution", [1920, 1080], [3840, 2160]],
  ["a small stage gets the minimum width", [760, 560], [1600, 1179]],
  ["a phone's stage gets the minimum width", [390, 844], [1600, 3463]],
  ["a large stage is limited in width", [2560, 1440], [4096, 2304]],
  ["a tall stage is limited in height", [320, 1200], [1092, 4096]],
])("%s", (_, [width, height], [wide, high]) =>
  expect(pictureSize(width, height)).toEqual({ width: wide, height: high }),
);
