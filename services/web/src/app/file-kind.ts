/** Kind of a dropped file: an avatar, a prop, or a motion for the library. */

/** Bytes before the JSON part of a GLB file, which begins with the length of that part. */
const GLB_HEADER_BYTES = 20;
const LENGTH_OFFSET = 12;
/** Largest JSON part that is read. Larger ones are those of avatars with long tables. */
const MAX_JSON_BYTES = 4 << 20;

export type FileKind = "avatar" | "motion" | "prop";

/** Extensions of the avatars in VRM 0.x and 1.0. */
const AVATAR_EXTENSIONS = ["VRM", "VRMC_vrm"];

/**
 * Return the kind of a file, by its extension, and for glTF by its content: with animations it is a motion, with a
 * skeleton an avatar, and else a prop.
 */
export async function findFileKind(file: File): Promise<FileKind> {
  const [extension] = /\.[^.]*$/.exec(file.name.toLowerCase()) ?? [];
  if (extension === ".vrm") return "avatar";
  if (extension !== ".glb" && extension !== ".gltf") return "motion";
  return findGltfKind(file, extension === ".glb");
}

async function findGltfKind(file: File, isBinary: boolean): Promise<FileKind> {
  try {
    const part = isBinary ? await findJsonPart(file) : file;
    if (part.size > MAX_JSON_BYTES) return "avatar";
    const { animations, skins, extensions } = JSON.parse(await part.text()) as Record<string, unknown>;
    const hasItems = (list: unknown) => Array.isArray(list) && list.length > 0;
    if (hasItems(animations)) return "motion";
    return hasItems(skins) || AVATAR_EXTENSIONS.some((name) => name in Object(extensions)) ? "avatar" : "prop";
  } catch {
    // The reader of avatars reports the problem.
    return "avatar";
  }
}

async function findJsonPart(file: File): Promise<Blob> {
  const header = new DataView(await file.slice(0, GLB_HEADER_BYTES).arrayBuffer());
  return file.slice(GLB_HEADER_BYTES, GLB_HEADER_BYTES + header.getUint32(LENGTH_OFFSET, true));
}
