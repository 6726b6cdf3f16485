/** Upload of a file. An XMLHttpRequest is used, since fetch does not report the progress of sending. */
import { type Access, pageAccess } from "./access";
import { ProblemError } from "./problem";

export interface UploadOptions {
  readonly access?: Access;
  readonly signal?: AbortSignal | undefined;
  /** Listener for the share of the file that is sent, 0..1. */
  readonly onProgress?: (share: number) => void;
  /** Listener for the end of sending: the server works on the file from then on. */
  readonly onSent?: () => void;
}

/**
 * Send a file as the body of a POST request to a path of the server. Return the JSON of the response.
 *
 * @throws ProblemError if the upload fails, or the reason of `signal` if it is aborted
 */
export function sendFile(
  path: string,
  file: File,
  { access = pageAccess, signal, onProgress, onSent }: UploadOptions = {},
): Promise<unknown> {
  const response = new Promise<string>((resolve, reject) => {
    signal?.throwIfAborted();
    const request = new XMLHttpRequest();
    const cancel = () => request.abort();
    signal?.addEventListener("abort", cancel, { once: true });
    request.upload.addEventListener("progress", ({ loaded, total }) => onProgress?.(total > 0 ? loaded / total : 0));
    request.upload.addEventListener("load", () => onSent?.());
    request.addEventListener("loadend", () => signal?.removeEventListener("abort", cancel));
    request.addEventListener("abort", () => reject(signal?.reason as Error));
    request.addEventListener("error", () => reject(ProblemError.unreachable(access.translator)));
    request.addEventListener("load", () => {
      if (request.status >= 300)
        reject(access.reportProblem(ProblemError.from(request.status, request.responseText, access.translator)));
      else resolve(request.responseText);
    });
    request.open("POST", access.server + path);
    request.setRequestHeader("Content-Type", "application/octet-stream");
    for (const [name, value] of Object.entries(access.authorization())) request.setRequestHeader(name, value);
    request.send(file);
  });
  return response.then((text) => JSON.parse(text) as unknown);
}
