import { expect, test } from "vitest";
import { cameraSupport } from "../../../src/ui/strings/camera-button";

test("a camera needs a browser that has them, and a page with HTTPS", () => {
  const getUserMedia = () => Promise.reject(new Error("not asked"));
  expect(cameraSupport({ getUserMedia }, true)).toBe("available");
  expect(cameraSupport({}, true)).toBe("unavailable");
  expect(cameraSupport(undefined, true)).toBe("unavailable");
  expect(cameraSupport(undefined, false)).toBe("needs HTTPS");
});
