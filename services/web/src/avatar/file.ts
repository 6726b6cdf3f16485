/**
 * Reads the JSON chunk of a GLB file and checks whether its figure can perform. Pure: meshes and textures are read
 * elsewhere.
 */
import { joinList, translate } from "../i18n/translator";
import { findBones, missingBones, type NamedNode } from "./bone-names";
import { AvatarError, exportAgainHint, fileBroken, fileTooLarge, MAX_FILE_BYTES } from "./error";

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const HEADER_BYTES = 12;
const CHUNK_HEADER_BYTES = 8;

/** glTF compressions that need separate decoders, with their common names. */
const COMPRESSION_EXTENSIONS: Readonly<Record<string, string>> = {
  KHR_draco_mesh_compression: "Draco",
  EXT_meshopt_compression: "meshopt",
  KHR_meshopt_compression: "meshopt",
  KHR_texture_basisu: "KTX2 textures",
};

const EXPORT_AS_GLB = "Export it as one binary glTF file, .glb or .vrm.";

/** Content of a file: bones as node indices, and the author's name for it, if any. */
export interface AvatarFile {
  vrm: boolean;
  name: string | null;
  bones: ReadonlyMap<string, number>;
}

/** Parse the description of a figure from a file's bytes. Throw AvatarError if it cannot be used. */
export function parseAvatarFile(bytes: ArrayBuffer): AvatarFile {
  if (bytes.byteLength > MAX_FILE_BYTES) throw fileTooLarge(bytes.byteLength);
  const json = asRecord(parseJsonChunk(bytes));
  for (const required of asList(json.extensionsRequired)) {
    const compression = COMPRESSION_EXTENSIONS[String(required)];
    if (compression)
      throw new AvatarError(
        translate("Unsupported compression"),
        translate("{compression} is not supported", { compression }),
        translate("Export it without {compression}.", { compression }),
      );
  }
  const externalCandidates = [
    ...asList(json.buffers),
    ...asList(json.images).filter((image) => !asText(asRecord(image).uri)?.startsWith("data:image/")),
  ];
  for (const uri of externalCandidates.map((part) => asText(asRecord(part).uri))) {
    if (uri)
      throw new AvatarError(
        translate("Not a single file"),
        translate("it refers to the external file {address}", { address: uri.slice(0, 60) }),
        translate(EXPORT_AS_GLB),
      );
  }
  const nodes = parseNodes(json);
  const vrmDeclaration = vrmBones(json);
  const bones = vrmDeclaration
    ? new Map([...vrmDeclaration.bones].filter(([, node]) => node in nodes))
    : findBones(nodes);
  const missing = missingBones(bones);
  if (missing.length > 0) {
    const detail =
      bones.size === 0
        ? translate("no humanoid bones found")
        : translate("missing bones: {bones}", { bones: joinList(missing) });
    throw new AvatarError(
      translate("No usable humanoid"),
      detail,
      translate("Bones are found in VRM files and by the names of Mixamo, VRoid, Unreal, Unity and H-Anim."),
    );
  }
  if (asList(json.meshes).length === 0)
    throw new AvatarError(translate("Nothing to draw"), translate("it has bones, but no mesh"), exportAgainHint());
  return { vrm: vrmDeclaration !== null, name: vrmDeclaration?.name ?? null, bones };
}

function parseJsonChunk(bytes: ArrayBuffer): unknown {
  const view = new DataView(bytes);
  if (bytes.byteLength < HEADER_BYTES || view.getUint32(0, true) !== MAGIC)
    throw new AvatarError(
      translate("Not a GLB file"),
      translate("it does not start like binary glTF"),
      translate(EXPORT_AS_GLB),
    );
  if (view.getUint32(4, true) !== 2)
    throw new AvatarError(
      translate("Unsupported glTF version"),
      translate("version {version}; only version 2 is supported", { version: view.getUint32(4, true) }),
      exportAgainHint(),
    );
  if (bytes.byteLength < HEADER_BYTES + CHUNK_HEADER_BYTES || view.getUint32(8, true) > bytes.byteLength)
    throw fileBroken(translate("the file is truncated"));
  const length = view.getUint32(HEADER_BYTES, true);
  const begin = HEADER_BYTES + CHUNK_HEADER_BYTES;
  if (view.getUint32(HEADER_BYTES + 4, true) !== JSON_CHUNK || begin + length > bytes.byteLength)
    throw fileBroken(translate("the JSON chunk is missing or too long"));
  try {
    return JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, begin, length)));
  } catch {
    throw fileBroken(translate("the JSON chunk cannot be parsed"));
  }
}

/** Return the bones that a VRM file (version 1 or 0) declares; null if it is not a VRM file. */
function vrmBones(json: Record<string, unknown>): { name: string | null; bones: Map<string, number> } | null {
  const extensions = asRecord(json.extensions);
  if (extensions.VRMC_vrm) {
    const { meta, humanoid } = asRecord(extensions.VRMC_vrm);
    const bones = Object.entries(asRecord(asRecord(humanoid).humanBones)).map(([bone, at]): [string, number] => [
      bone,
      Number(asRecord(at).node),
    ]);
    return { name: asText(asRecord(meta).name), bones: new Map(bones) };
  }
  if (extensions.VRM) {
    const { meta, humanoid } = asRecord(extensions.VRM);
    const bones = asList(asRecord(humanoid).humanBones).map((at): [string, number] => [
      String(asRecord(at).bone),
      Number(asRecord(at).node),
    ]);
    return { name: asText(asRecord(meta).title), bones: new Map(bones) };
  }
  return null;
}

function parseNodes(json: Record<string, unknown>): NamedNode[] {
  const nodes = asList(json.nodes).map((node) => ({ name: asText(asRecord(node).name) ?? "", parent: -1 }));
  asList(json.nodes).forEach((node, parent) => {
    for (const child of asList(asRecord(node).children)) if (nodes[Number(child)]) nodes[Number(child)].parent = parent;
  });
  return nodes;
}

function asRecord(value: unknown): Record<string, unknown> {
  return typeof value === "object" && value !== null ? (value as Record<string, unknown>) : {};
}

function asList(value: unknown): unknown[] {
  return Array.isArray(value) ? value : [];
}

function asText(value: unknown): string | null {
  return typeof value === "string" && value.trim() ? value.trim() : null;
}
