/** Figures in test files with morph targets, and expressions of VRM that use them. */
import { readFile } from "../compressed-files";
import { createFigureFile, type FigureOptions } from "../figure-files";
import { container } from "../glb-container";

export interface FaceOptions extends FigureOptions {
  /** Names of the mesh's morph targets, which move nothing. */
  morphs: readonly string[];
  /** Names of VRM expressions, each of the morph target of the same index; VRM 0 has its own names of presets. */
  presets?: readonly string[];
  custom?: readonly string[];
  /** Type of the gaze of a VRM file. */
  lookAt?: "bone" | "expression";
  /** Names of nodes below the head. */
  eyes?: readonly string[];
}

/** Return the bytes of a GLB or VRM file. */
export function createFaceFile(options: FaceOptions): Uint8Array<ArrayBuffer> {
  const { morphs, presets = [], custom = [], lookAt, eyes = [], vrm } = options;
  const file = createFigureFile(options);
  const { json } = readFile(file);
  const binary = file.slice(file.length - Number(json.buffers[0].byteLength));
  const nodes = json.nodes as { name: string; mesh?: number; children?: number[] }[];
  const [mesh] = json.meshes as unknown as {
    primitives: { attributes: Record<string, number>; targets: unknown }[];
    extras: unknown;
  }[];
  const zeros = json.accessors.push({
    componentType: 5126,
    count: json.accessors[mesh.primitives[0].attributes.POSITION].count,
    type: "VEC3",
    min: [0, 0, 0],
    max: [0, 0, 0],
  });
  mesh.primitives[0].targets = morphs.map(() => ({ POSITION: zeros - 1 }));
  mesh.extras = { targetNames: morphs };
  const head = nodes.find(({ name }) => /head$/i.test(name)) as (typeof nodes)[number];
  const eyeNodes = eyes.map((name) => nodes.push({ name, ...{ translation: [0, 0.08, 0.05] } }) - 1);
  head.children = [...(head.children ?? []), ...eyeNodes];
  const body = nodes.findIndex((node) => node.mesh === 0);
  const range = { inputMaxValue: 90, outputScale: lookAt === "bone" ? 30 : 1 };
  const extensions = json.extensions as Record<string, Record<string, unknown>>;
  if (vrm === 1) {
    const bind = (index: number) => ({ morphTargetBinds: [{ node: body, index, weight: 1 }] });
    const { humanoid } = extensions.VRMC_vrm as { humanoid: { humanBones: Record<string, unknown> } };
    eyeNodes.forEach((node, at) => {
      humanoid.humanBones[["leftEye", "rightEye"][at]] = { node };
    });
    Object.assign(extensions.VRMC_vrm, {
      expressions: {
        preset: Object.fromEntries(presets.map((name, index) => [name, bind(index)])),
        custom: Object.fromEntries(custom.map((name, index) => [name, bind(presets.length + index)])),
      },
      ...(lookAt
        ? {
            lookAt: {
              type: lookAt,
              offsetFromHeadBone: [0, 0.06, 0],
              rangeMapHorizontalInner: range,
              rangeMapHorizontalOuter: range,
              rangeMapVerticalDown: range,
              rangeMapVerticalUp: range,
            },
          }
        : {}),
    });
  } else if (vrm === 0) {
    extensions.VRM.blendShapeMaster = {
      blendShapeGroups: presets.map((presetName, index) => ({
        name: presetName,
        presetName,
        binds: [{ mesh: 0, index, weight: 100 }],
      })),
    };
  }
  return container(json, binary);
}
