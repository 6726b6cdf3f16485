/** HTTP API for props that are made of model files and stored by the server, for everybody (`proto/http.md`). */
import { type Access, pageAccess } from "./access";
import { type Page, queryOf, requestJson } from "./api";
import { sendFile, type UploadOptions } from "./file-upload";
import { ProblemError } from "./problem";

/** Prop as described by the server. Its id is the `kind` of the props that are made of it. */
export interface StoredProp {
  id: string;
  name: string;
  filename: string;
  created: string;
  vertices: number;
  triangles: number;
  bytes: number;
  /** Width, height and depth in metres. */
  size: [number, number, number];
  /** What the server assumed about the file, as sentences. */
  guessed: string[];
}

/** Longest time without data while a model is fetched. */
const STALL_TIMEOUT_MS = 30_000;

/** List stored props, newest first, at most `limit`. */
export function listProps(
  { limit, cursor }: { readonly limit?: number; readonly cursor?: string } = {},
  access: Access = pageAccess,
): Promise<Page<StoredProp>> {
  const query = queryOf({ limit: limit === undefined ? limit : String(limit), cursor });
  return requestJson("GET", `/v1/props${query}`, undefined, access) as Promise<Page<StoredProp>>;
}

/** Get a stored prop. */
export function getProp(id: string, access: Access = pageAccess): Promise<StoredProp> {
  return requestJson("GET", pathOf(id), undefined, access) as Promise<StoredProp>;
}

/**
 * Store a GLB file, or a glTF file with embedded data, as a prop. A file that is stored already is that prop.
 *
 * @throws ProblemError if the upload fails, or the reason of the options' `signal` if it is aborted
 */
export async function uploadProp(file: File, options: UploadOptions = {}): Promise<StoredProp> {
  return (await sendFile(`/v1/props?filename=${encodeURIComponent(file.name)}`, file, options)) as StoredProp;
}

/** Delete a stored prop. */
export async function deleteProp(id: string, access: Access = pageAccess): Promise<void> {
  await requestJson("DELETE", pathOf(id), undefined, access);
}

/**
 * Fetch the model of a stored prop, a GLB file that the server has made. Rejects with ProblemError, also if nothing
 * arrives for some time: on a constrained link, the whole may take minutes.
 */
export async function fetchPropModel(id: string, access: Access): Promise<ArrayBuffer> {
  const stalled = new AbortController();
  const startTimer = () => setTimeout(() => stalled.abort(), STALL_TIMEOUT_MS);
  let timer = startTimer();
  const watch = new TransformStream<Uint8Array<ArrayBuffer>, Uint8Array<ArrayBuffer>>({
    transform(chunk, controller) {
      clearTimeout(timer);
      timer = startTimer();
      controller.enqueue(chunk);
    },
  });
  try {
    // The motion is more urgent.
    const { body } = await access.request(`${access.server}${pathOf(id)}/model`, {
      priority: "low",
      signal: stalled.signal,
    });
    return await new Response(body?.pipeThrough(watch) ?? null).arrayBuffer();
  } catch (error) {
    throw error instanceof ProblemError ? error : ProblemError.unreachable(access.translator);
  } finally {
    clearTimeout(timer);
  }
}

function pathOf(id: string): string {
  return `/v1/props/${encodeURIComponent(id)}`;
}
