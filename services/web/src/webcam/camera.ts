/** The camera of this device: opening and closing it, and its pictures in the order of time. */

/** Reason why there is no picture. */
export type CameraFailure = "denied" | "missing" | "busy" | "failed";

export class CameraError extends Error {
  override readonly name = "CameraError";

  constructor(readonly failure: CameraFailure) {
    super(`The camera cannot be used: ${failure}.`);
  }
}

/** Picture that the detector needs; it works at a fraction of this size. */
const CONSTRAINTS: MediaStreamConstraints = {
  audio: false,
  video: { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 }, facingMode: "user" },
};

/** Part of the browser that opens cameras. */
export type CameraSource = Pick<MediaDevices, "getUserMedia">;

/**
 * Ask for the camera and return its stream.
 *
 * @throws CameraError
 */
export async function openCamera(source: CameraSource): Promise<MediaStream> {
  try {
    return await source.getUserMedia(CONSTRAINTS);
  } catch (error) {
    throw new CameraError(failureOf(error));
  }
}

/** Stop all tracks of a stream: the light of the camera goes off. */
export function closeCamera(stream: MediaStream): void {
  for (const track of stream.getTracks()) track.stop();
}

/** Names of errors: Media Capture and Streams, section 10.2. */
function failureOf(error: unknown): CameraFailure {
  switch (error instanceof DOMException ? error.name : "") {
    case "NotAllowedError":
    case "SecurityError":
      return "denied";
    case "NotFoundError":
    case "OverconstrainedError":
      return "missing";
    case "NotReadableError":
    case "AbortError":
      return "busy";
    default:
      return "failed";
  }
}
