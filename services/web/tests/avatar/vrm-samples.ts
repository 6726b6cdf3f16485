/** Real VRM files, where they are at hand. */
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { AvatarModel } from "../../src/avatar/model";

/** Folder of the files; it need not exist. */
export const VRM_FOLDER =
  process.env["BUNRAKU_VRM_SAMPLES"] ?? join(import.meta.dirname, "../../../../../shared/samples/vrm");

/** Return the model of a file. */
export async function readVrmSample(name: string): Promise<AvatarModel> {
  // Images need a page.
  return AvatarModel.parse(withoutImages(readFileSync(join(VRM_FOLDER, name))), name);
}

/** Return a GLB file whose materials have no textures. */
function withoutImages(file: Uint8Array): ArrayBuffer {
  const view = new DataView(file.buffer, file.byteOffset);
  const length = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(file.subarray(20, 20 + length)));
  for (const key of ["images", "textures", "samplers"]) delete json[key];
  json.materials = json.materials?.map(() => ({}));
  if (json.extensions?.VRM) json.extensions.VRM.materialProperties = [];
  const text = new TextEncoder().encode(JSON.stringify(json).padEnd(length));
  const whole = new Uint8Array(file);
  whole.set(text, 20);
  return whole.buffer;
}
