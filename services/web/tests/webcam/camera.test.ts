import { expect, test } from "vitest";
import { CameraError, closeCamera, openCamera } from "../../src/webcam/camera";

const failing = (error: unknown) => ({ getUserMedia: () => Promise.reject(error) });

test.each([
  ["NotAllowedError", "denied"],
  ["SecurityError", "denied"],
  ["NotFoundError", "missing"],
  ["OverconstrainedError", "missing"],
  ["NotReadableError", "busy"],
  ["AbortError", "busy"],
  ["InvalidStateError", "failed"],
])("%s: the camera is %s", async (name, failure) => {
  const error = await openCamera(failing(new DOMException("", name))).catch((reason: unknown) => reason);
  expect(error).toBeInstanceOf(CameraError);
  expect((error as CameraError).failure).toBe(failure);
});

test("any other error is a failure of the camera", async () => {
  await expect(openCamera(failing(new TypeError("")))).rejects.toMatchObject({ failure: "failed" });
});

test("only a picture is asked for, no sound", async () => {
  const asked: (MediaStreamConstraints | undefined)[] = [];
  const stream = {} as MediaStream;
  const source = {
    getUserMedia: (constraints?: MediaStreamConstraints) => {
      asked.push(constraints);
      return Promise.resolve(stream);
    },
  };
  expect(await openCamera(source)).toBe(stream);
  expect(asked).toHaveLength(1);
  expect(asked[0]).toMatchObject({ audio: false, video: { facingMode: "user" } });
});

test("closing stops every track", () => {
  const stopped: number[] = [];
  const stream = { getTracks: () => [1, 2].map((track) => ({ stop: () => stopped.push(track) })) };
  closeCamera(stream as unknown as MediaStream);
  expect(stopped).toEqual([1, 2]);
});
