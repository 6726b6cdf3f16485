/** Kind of a dropped file: an avatar, or a motion for the library. */

/** Bytes before the JSON part of a GLB file, which begins with the length of that part. */
const GLB_HEADER_BYTES = 20;
const LENGTH_OFFSET = 12;
/** Largest JSON part that is read. Larger ones are those of avatars with long tables. */
const MAX_JSON_BYTES = 4 << 20;

export type FileKind = "avatar" | "motion";

/** Return the kind of a file, by its extension, and for glTF by its content: a file with animations is a motion. */
export async function findFileKind(file: File): Promise<FileKind> {
  const [extension] = /\.[^.]*$/.exec(file.name.toLowerCase()) ?? [];
  if (extension === ".vrm") return "avatar";
  if (extension !== ".glb" && extension !== ".gltf") return "motion";
  return (await hasAnimations(file, extension === ".glb")) ? "motion" : "avatar";
}

async function hasAnimations(file: File, isBinary: boolean): Promise<boolean> {
  try {
    const part = isBinary ? await findJsonPart(file) : file;
    if (part.size > MAX_JSON_BYTES) return false;
    const { animations } = JSON.parse(await part.text()) as { animations?: unknown };
    return Array.isArray(animations) && animations.length > 0;
  } catch {
    // The reader of avatars reports the problem.
    return false;
  }
}

async function findJsonPart(file: File): Promise<Blob> {
  const header = new DataView(await file.slice(0, GLB_HEADER_BYTES).arrayBuffer());
  return file.slice(GLB_HEADER_BYTES, GLB_HEADER_BYTES + header.getUint32(LENGTH_OFFSET, true));
}
