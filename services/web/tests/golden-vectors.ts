/** The golden vectors of `proto/vectors`, and bytes as they stand in them. */

const files = import.meta.glob("../../../proto/vectors/*.json", { eager: true, import: "default" });

/** The vectors of one file, by name without its end. */
export function loadVectors<T>(name: string): T {
  const found = files[`../../../proto/vectors/${name}.json`];
  if (found === undefined) throw new Error(`proto/vectors/${name}.json is missing`);
  return found as T;
}

/** Bytes from base64. */
export function decodeBase64(base64: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
}
