/** HTTP API for changing motions of the library (`proto/http.md`). */

import { pageAccess } from "./access";
import { createUploadId, type Motion, pollProgress, requestJson, type UploadProgress } from "./api";

/** New name or tags of a motion; absent ones stay. */
export interface MotionLabels {
  name?: string;
  tags?: readonly string[];
}

/** Edit that makes a new motion; `start` and `end` in microseconds of motion time. It has at least one effect. */
export interface MotionEdit {
  start?: number;
  end?: number;
  mirror?: boolean;
  loop?: boolean;
  name?: string;
}

/** Change the name or the tags of a motion. */
export function updateMotion(id: string, labels: MotionLabels, access = pageAccess): Promise<Motion> {
  return requestJson("PATCH", pathOf(id), labels, access) as Promise<Motion>;
}

/**
 * Create an edited copy of a motion. `onProgress` receives the server's progress.
 *
 * @throws ProblemError if it fails, also after `signal` was aborted
 */
export async function editMotion(
  id: string,
  edit: MotionEdit,
  onProgress?: (progress: UploadProgress) => void,
  signal?: AbortSignal,
  access = pageAccess,
): Promise<Motion> {
  const uploadId = createUploadId();
  const ended = new AbortController();
  if (onProgress) void pollProgress(uploadId, onProgress, ended.signal);
  try {
    return (await requestJson("POST", `${pathOf(id)}/edits?upload=${uploadId}`, edit, access, signal)) as Motion;
  } finally {
    ended.abort();
  }
}

/** Fetch the small picture of a motion, an SVG. */
export async function fetchThumbnail(id: string, access = pageAccess): Promise<Blob> {
  return (await access.request(`${access.server}${pathOf(id)}/thumbnail`)).blob();
}

function pathOf(id: string): string {
  return `/v1/motions/${encodeURIComponent(id)}`;
}
