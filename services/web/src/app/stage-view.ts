/**
 * View of the page without controls, for streaming software and projections: `?view=stage`, with
 * `&background=transparent` and `&camera=...`.
 */

import type { FixedCamera, StageView } from "../engine/message";

/** Vertical field of view if the address has none, in degrees. */
const DEFAULT_FOV_DEG = 26;
const [MIN_FOV_DEG, MAX_FOV_DEG] = [5, 120];
/** Largest coordinate, in metres. */
const MAX_COORDINATE_M = 100;
/** Minimum distance between the camera and what it looks at, in metres. */
const MIN_DISTANCE_M = 0.05;

/** A value in the page's address that cannot be used; the message is for the user, in English. */
export class StageViewError extends Error {}

/** Return the view that an address asks for, null for the page with its controls. Throw `StageViewError`. */
export function readStageView(query: URLSearchParams): StageView | null {
  const view = query.get("view");
  if (view === null) return null;
  if (view !== "stage") throw new StageViewError(`view=${view.slice(0, 40)} is unknown; the only view is "stage".`);
  const background = query.get("background");
  if (background !== null && background !== "transparent")
    throw new StageViewError(`background=${background.slice(0, 40)} is unknown; leave it out, or use "transparent".`);
  const camera = query.get("camera");
  return { isTransparent: background !== null, camera: camera === null ? null : parseCamera(camera) };
}

function parseCamera(text: string): FixedCamera {
  const words = text.split(",").map((word) => word.trim());
  const numbers = words.map((word) => (word === "" ? NaN : Number(word)));
  if (![6, 7].includes(numbers.length) || !numbers.every(Number.isFinite))
    throw new StageViewError(
      "camera must be 6 or 7 numbers with commas between them: its position (x,y,z) and what it looks at (x,y,z), in " +
        "metres, and its vertical field of view in degrees.",
    );
  const [x, y, z, gazeX, gazeY, gazeZ, fov = DEFAULT_FOV_DEG] = numbers;
  if (![x, y, z, gazeX, gazeY, gazeZ].every((value) => Math.abs(value) <= MAX_COORDINATE_M))
    throw new StageViewError(`camera: a coordinate is more than ${MAX_COORDINATE_M} metres from the centre.`);
  if (Math.hypot(x - gazeX, y - gazeY, z - gazeZ) < MIN_DISTANCE_M)
    throw new StageViewError("camera: its position and what it looks at are the same place.");
  if (!(fov >= MIN_FOV_DEG && fov <= MAX_FOV_DEG))
    throw new StageViewError(`camera: the field of view must be ${MIN_FOV_DEG} to ${MAX_FOV_DEG} degrees.`);
  return [x, y, z, gazeX, gazeY, gazeZ, (fov * Math.PI) / 180];
}
