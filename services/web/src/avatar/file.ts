/**
 * Reads the description of a GLB file and checks whether its figure can perform. Pure: meshes and textures are read
 * elsewhere, after this check.
 */
import { joinList, translate } from "../i18n/translator";
import { cleanName } from "./author-name";
import { findBones, missingBones } from "./bone-names";
import { AvatarError, exportAgainHint } from "./error";
import { type Compression, findCompressions } from "./gltf/compression";
import { parseContainer } from "./gltf/container";
import { checkData } from "./gltf/data-check";
import { collectJoints } from "./gltf/joint-tree";
import { asList, asRecord, asText } from "./gltf/json";
import { checkScene } from "./gltf/scene-check";
import { GltfJson, invalidField } from "./gltf/schema";

/** Names of parts that an error quotes. */
const MAX_QUOTED_NAMES = 3;

/** Content of a file: bones as node indices, and the author's name for it, if any. */
export interface AvatarFile {
  vrm: boolean;
  name: string | null;
  bones: ReadonlyMap<string, number>;
  /** Compressions that need decoders. */
  compressions: ReadonlySet<Compression>;
}

/** Parse the description of a figure from a file's bytes. Throw AvatarError if it cannot be used. */
export function parseAvatarFile(bytes: ArrayBuffer): AvatarFile {
  const { json: description, binary } = parseContainer(bytes);
  const json = new GltfJson(asRecord(description));
  const { version } = asRecord(json.root.asset);
  if (!/^2\.\d+$/.test(asText(version) ?? "")) throw invalidField("asset.version", version);
  const parents = checkScene(json);
  checkData(json, binary?.length ?? 0);
  const compressions = findCompressions(json, binary ?? new Uint8Array());
  const declaration = vrmBones(json);
  const bones = declaration ? declaredBones(json, declaration.bones) : undeclaredBones(json, parents);
  if (json.list("meshes").length === 0)
    throw new AvatarError(translate("Nothing to draw"), translate("it has bones, but no mesh"), exportAgainHint());
  return { vrm: declaration !== null, name: declaration?.name ?? null, bones, compressions };
}

/** Return the bones that a VRM file declares. Throw AvatarError if required ones are missing. */
function declaredBones(json: GltfJson, declared: ReadonlyMap<string, number>): ReadonlyMap<string, number> {
  const bones = new Map([...declared].filter(([, node]) => node in json.list("nodes")));
  const missing = missingBones(bones);
  if (missing.length > 0) throw bonesMissing(missing);
  return bones;
}

/** Return the bones that names or shape give. Throw AvatarError if required ones are missing. */
function undeclaredBones(json: GltfJson, parents: readonly number[]): ReadonlyMap<string, number> {
  const joints = collectJoints(json, parents);
  const bones = findBones(joints);
  const missing = missingBones(bones);
  if (missing.length === 0) return new Map([...bones].map(([bone, joint]) => [bone, joints.nodes[joint]]));
  throw bones.size > 0 ? bonesMissing(missing) : noBody(json);
}

function bonesMissing(missing: readonly string[]): AvatarError {
  return new AvatarError(
    translate("No usable humanoid"),
    translate("missing bones: {bones}", { bones: joinList(missing) }),
    bonesHint(),
  );
}

/** Return the error for a file without a body, such as a helmet or a car. */
function noBody(json: GltfJson): AvatarError {
  const names = ["meshes" as const, "nodes" as const].flatMap((list) =>
    json.list(list).map((item) => cleanName(asText(asRecord(item).name))),
  );
  const quoted = [...new Set(names.filter((name) => name !== null))].slice(0, MAX_QUOTED_NAMES);
  const joints = new Set(json.list("skins").flatMap((skin) => asList(asRecord(skin).joints)));
  const counts = { meshes: json.list("meshes").length, joints: joints.size };
  return new AvatarError(
    translate("No usable humanoid"),
    quoted.length > 0
      ? translate("no body found; meshes: {meshes}, joints: {joints} ({names})", {
          ...counts,
          names: joinList(quoted),
        })
      : translate("no body found; meshes: {meshes}, joints: {joints}", counts),
    bonesHint(),
  );
}

function bonesHint(): string {
  return translate(
    "An avatar needs a skeleton with two arms, two legs and a head: a VRM file, or joints named as by Mixamo, Blender, Unreal, Unity or H-Anim.",
  );
}

/** Return the bones that a VRM file (version 1 or 0) declares; null if it is not a VRM file. */
function vrmBones(json: GltfJson): { name: string | null; bones: Map<string, number> } | null {
  const extensions = asRecord(json.root.extensions);
  if (extensions.VRMC_vrm) {
    const { meta, humanoid } = asRecord(extensions.VRMC_vrm);
    const bones = Object.entries(asRecord(asRecord(humanoid).humanBones)).map(([bone, at]): [string, number] => [
      bone,
      Number(asRecord(at).node),
    ]);
    return { name: cleanName(asText(asRecord(meta).name)), bones: new Map(bones) };
  }
  if (extensions.VRM) {
    const { meta, humanoid } = asRecord(extensions.VRM);
    const bones = asList(asRecord(humanoid).humanBones).map((at): [string, number] => [
      newThumbName(String(asRecord(at).bone)),
      Number(asRecord(at).node),
    ]);
    return { name: cleanName(asText(asRecord(meta).title)), bones: new Map(bones) };
  }
  return null;
}

/** Return VRM 1's name of a VRM 0 bone: those of the thumb's joints are one joint further out. */
function newThumbName(bone: string): string {
  return bone.replace("ThumbProximal", "ThumbMetacarpal").replace("ThumbIntermediate", "ThumbProximal");
}
