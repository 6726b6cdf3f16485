/** Files of the pose detector, about 12 MB, which the page's own server sends. */
import landmarksUrl from "@mediapipe/pose/pose_landmark_lite.tflite?url";
import detectorUrl from "@mediapipe/pose/pose_solution_packed_assets.data?url";
import programUrl from "@mediapipe/pose/pose_solution_simd_wasm_bin.wasm?url";
import graphUrl from "@mediapipe/pose/pose_web.binarypb?url";

/** Addresses and sizes of the files, in bytes without compression. */
const FILES = {
  program: { url: programUrl, bytes: 6_104_372 },
  /** Model that finds the person. */
  detector: { url: detectorUrl, bytes: 2_962_288 },
  /** Model that finds the landmarks. */
  landmarks: { url: landmarksUrl, bytes: 2_819_824 },
  graph: { url: graphUrl, bytes: 1_007 },
} as const;

type FileName = keyof typeof FILES;
export type ModelFiles = Readonly<Record<FileName, ArrayBuffer>>;

const TOTAL_BYTES = Object.values(FILES).reduce((sum, { bytes }) => sum + bytes, 0);

/**
 * Load the files. `onProgress` gets the share that has arrived, 0 to 1. The worker that loads them is terminated to
 * cancel.
 *
 * @throws Error if a file cannot be loaded
 */
export async function loadModelFiles(onProgress: (share: number) => void): Promise<ModelFiles> {
  let loaded = 0;
  const names = Object.keys(FILES) as FileName[];
  const contents = await Promise.all(
    names.map((name) =>
      loadFile(FILES[name].url, (bytes) => {
        loaded += bytes;
        onProgress(Math.min(1, loaded / TOTAL_BYTES));
      }),
    ),
  );
  return Object.fromEntries(names.map((name, index) => [name, contents[index]])) as Record<FileName, ArrayBuffer>;
}

async function loadFile(url: string, onBytes: (count: number) => void): Promise<ArrayBuffer> {
  const response = await fetch(url);
  if (!response.ok || !response.body) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  const chunks: Uint8Array<ArrayBuffer>[] = [];
  const reader = response.body.getReader();
  for (let { done, value } = await reader.read(); !done; { done, value } = await reader.read()) {
    if (!value) continue;
    chunks.push(value);
    onBytes(value.length);
  }
  return new Blob(chunks).arrayBuffer();
}
