/** Access to the golden vectors of `proto/vectors`. */

const files = import.meta.glob("../../../proto/vectors/*.json", { eager: true, import: "default" });

/** Returns the vectors of a file by its name without extension. */
export function loadVectors<T>(name: string): T {
  const found = files[`../../../proto/vectors/${name}.json`];
  if (found === undefined) throw new Error(`proto/vectors/${name}.json is missing`);
  return found as T;
}

/** Decodes base64. */
export function decodeBase64(base64: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
}
