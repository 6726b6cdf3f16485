/** Compressions of meshes and textures in a file, checked before they are decoded. */

import { megabytes } from "./data-check";
import { checkDraco, type DracoCounts } from "./draco";
import { asList, asRecord } from "./json";
import { checkKtx2 } from "./ktx2";
import { type GltfJson, invalidField, tooMuch } from "./schema";

/** Compressions that need decoders of their own. */
export type Compression = "meshopt" | "Draco" | "KTX2";

/** Limit of all compressed textures when decoded to four bytes per pixel. */
export const MAX_TEXTURE_BYTES = 512e6;

const DRACO = "KHR_draco_mesh_compression";
const BASISU = "KHR_texture_basisu";

/** Return the compressions in a file with this binary chunk. Throw AvatarError if their data are impossible. */
export function findCompressions(json: GltfJson, binary: Uint8Array): Set<Compression> {
  const found = new Set<Compression>();
  const isMeshopt = (item: unknown) =>
    Object.keys(asRecord(asRecord(item).extensions)).some((name) => name.endsWith("_meshopt_compression"));
  if (json.list("bufferViews").some(isMeshopt)) found.add("meshopt");
  json.list("meshes").forEach((mesh, index) => {
    asList(asRecord(mesh).primitives).forEach((primitive, at) => {
      const extension = asRecord(asRecord(primitive).extensions)[DRACO];
      if (extension === undefined) return;
      found.add("Draco");
      const field = `meshes[${index}].primitives[${at}].extensions.${DRACO}`;
      const bytes = viewBytes(json, binary, asRecord(extension).bufferView, `${field}.bufferView`);
      const { attributes, indices } = asRecord(primitive);
      const position = json.item("accessors", Number(asRecord(attributes).POSITION));
      checkDraco(bytes, field, {
        points: Number(position.count),
        faces: indices === undefined ? null : Number(json.item("accessors", Number(indices)).count) / 3,
      } satisfies DracoCounts);
    });
  });
  let textureBytes = 0;
  const images = new Set(
    json.list("textures").flatMap((texture) => {
      const source = asRecord(asRecord(asRecord(texture).extensions)[BASISU]).source;
      return typeof source === "number" ? [source] : [];
    }),
  );
  for (const image of images) {
    found.add("KTX2");
    const field = `images[${image}]`;
    const { bufferView } = json.item("images", image);
    if (bufferView === undefined) throw invalidField(`${field}.bufferView`, bufferView);
    textureBytes += checkKtx2(viewBytes(json, binary, bufferView, `${field}.bufferView`), field);
    if (textureBytes > MAX_TEXTURE_BYTES) throw tooMuch(field, megabytes(textureBytes), megabytes(MAX_TEXTURE_BYTES));
  }
  return found;
}

/** Return the bytes of a view, which must lie within the binary chunk. */
function viewBytes(json: GltfJson, binary: Uint8Array, value: unknown, field: string): Uint8Array {
  const { byteOffset = 0, byteLength } = json.item("bufferViews", json.reference("bufferViews", value, field));
  return binary.subarray(Number(byteOffset), Number(byteOffset) + Number(byteLength));
}
