/** Golden vectors of `proto/vectors`. */

const files = import.meta.glob("../../../proto/vectors/*.json", { eager: true, import: "default" });

/** Return the vectors of a file, by name without extension. */
export function loadVectors<T>(name: string): T {
  const vectors = files[`../../../proto/vectors/${name}.json`];
  if (vectors === undefined) throw new Error(`proto/vectors/${name}.json is missing`);
  return vectors as T;
}

/** Decode base64. */
export function decodeBase64(base64: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
}
