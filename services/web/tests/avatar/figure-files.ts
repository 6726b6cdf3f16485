/** Writer of GLB and VRM files with figures of boxes on bones, in various rest poses, axes, units and names. */
import { Euler, Matrix4, Quaternion, type Vector3 } from "three";
import { addBox } from "./box-mesh";
import { at, bend, bonesOf, type FigureShape } from "./figure-bones";
import { container, pack } from "./glb-container";

export interface FigureOptions extends FigureShape {
  /** Facing, as a rotation about y from z in degrees. */
  facing?: number;
  /** Metres per unit of the file: 0.01 for centimetres, with a scaled root node as tools write it. */
  unit?: number;
  /** Give bones arbitrary local axes. */
  askew?: boolean;
  /** Return the name of a bone's node. */
  name?: (bone: string) => string;
  vrm?: 1 | 0;
  /** Author's name of a VRM file. */
  title?: string;
  /** Add a texture, and MToon materials if the file is a VRM. */
  dressed?: boolean;
  /** Lay the figure on its back, as tools with z up may. */
  lying?: boolean;
}

/** Image of two by two pixels, PNG. */
const PNG_BASE64 =
  "iVBORw0KGgoAAAANSUhEUgAAAAIAAAACCAYAAABytg0kAAAAEUlEQVR42mOIWnDiPwgzwBgAXwgLBRyxh08AAAAASUVORK5CYII=";

/** Return the bytes of a GLB or VRM file. */
export function createFigureFile(options: FigureOptions = {}): Uint8Array<ArrayBuffer> {
  const {
    facing = options.vrm === 0 ? 180 : 0,
    unit = 1,
    askew = false,
    name = (bone: string) => bone,
    vrm,
    tail = false,
    dressed = false,
    lying = false,
  } = options;
  const bones = bonesOf(options);
  const face = new Quaternion().setFromAxisAngle(at(0, 1, 0), (facing * Math.PI) / 180);
  const places = new Map<string, Vector3>();
  const turns = new Map<string, Quaternion>();
  const about = (bone: string) =>
    face.clone().multiply(new Quaternion().setFromAxisAngle(at(0, 0, 1), bend(bone, options)));
  bones.forEach((bone, index) => {
    const from = bone.parent ? (places.get(bone.parent) as Vector3) : at(0, 0, 0);
    places.set(
      bone.name,
      from.clone().add(bone.offset.clone().applyQuaternion(bone.parent ? about(bone.parent) : face)),
    );
    const axes = askew
      ? new Quaternion().setFromEuler(new Euler(0.7 * index, 1.3 * index, 0.4 * index))
      : new Quaternion();
    turns.set(bone.name, about(bone.name).multiply(axes));
  });

  const [positions, normals, joints, weights, indices, inverses]: number[][] = [[], [], [], [], [], []];
  bones.forEach((bone, index) => {
    const from = places.get(bone.name) as Vector3;
    const thickness = bone.name === "head" ? 0.09 : /hips|spine|chest/.test(bone.name) ? 0.1 : 0.03;
    const tip = from.clone().add(bone.end.clone().applyQuaternion(about(bone.name)));
    // The sole is level at height 0: the box of the foot ends there.
    addBox(from, tip, thickness, positions, normals, indices, /Foot|Toes/.test(bone.name) ? 0 : null);
    for (let i = joints.length / 4; i < positions.length / 3; i++) {
      joints.push(index, 0, 0, 0);
      weights.push(1, 0, 0, 0);
    }
    inverses.push(
      ...new Matrix4()
        .compose(from, turns.get(bone.name) as Quaternion, at(1, 1, 1))
        .multiply(new Matrix4().makeScale(unit, unit, unit))
        .invert().elements,
    );
  });

  const nodes: Record<string, unknown>[] = bones.map((bone) => {
    const parent = bone.parent === null ? new Quaternion() : (turns.get(bone.parent) as Quaternion);
    const from = bone.parent === null ? at(0, 0, 0) : (places.get(bone.parent) as Vector3);
    const back = parent.clone().invert();
    const children = bones.flatMap((child, index) => (child.parent === bone.name ? [index] : []));
    return {
      name: name(bone.name),
      translation: (places.get(bone.name) as Vector3)
        .clone()
        .sub(from)
        .applyQuaternion(back)
        .divideScalar(unit)
        .toArray(),
      rotation: back.multiply(turns.get(bone.name) as Quaternion).toArray(),
      ...(children.length > 0 ? { children } : {}),
    };
  });
  const roots = bones.flatMap((bone, index) => (bone.parent === null ? [index] : []));
  const root =
    nodes.push({
      name: "Armature",
      children: roots,
      scale: [unit, unit, unit],
      ...(lying ? { rotation: [-Math.SQRT1_2, 0, 0, Math.SQRT1_2] } : {}),
    }) - 1;
  const mesh = nodes.push({ name: "Body", mesh: 0, skin: 0 }) - 1;
  const index = (bone: string) => bones.findIndex((one) => one.name === bone);
  const humanBones = bones.map(({ name }) => name).filter((bone) => !bone.startsWith("tail"));

  const picture = Uint8Array.from(atob(PNG_BASE64), (letter) => letter.charCodeAt(0));
  const { buffer, views, accessors } = pack(
    [
      [new Float32Array(positions), "VEC3", 34962],
      [new Float32Array(normals), "VEC3", 34962],
      [new Uint8Array(joints), "VEC4", 34962],
      [new Float32Array(weights), "VEC4", 34962],
      [new Uint16Array(indices), "SCALAR", 34963],
      [new Float32Array(inverses), "MAT4", undefined],
      ...(dressed ? [[textureCoordinates(positions.length / 3), "VEC2", 34962] as const] : []),
    ],
    picture,
  );
  const json: Record<string, unknown> = {
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [root, mesh] }],
    nodes,
    meshes: [
      { primitives: [{ attributes: { POSITION: 0, NORMAL: 1, JOINTS_0: 2, WEIGHTS_0: 3 }, indices: 4, material: 0 }] },
    ],
    materials: [
      { pbrMetallicRoughness: { baseColorFactor: [0.5, 0.25, 0.6, 1], metallicFactor: 0, roughnessFactor: 0.8 } },
    ],
    skins: [{ inverseBindMatrices: 5, joints: bones.map((_, at) => at), skeleton: root }],
    buffers: [{ byteLength: buffer.length }],
    bufferViews: views,
    accessors,
  };
  if (dressed) addMaterials(json, vrm);
  if (vrm === 1) {
    const springs = tail
      ? {
          VRMC_springBone: {
            specVersion: "1.0",
            springs: [
              {
                name: "tail",
                joints: [
                  { node: index("tail"), stiffness: 0.5, dragForce: 0.2, gravityPower: 1, gravityDir: [0, -1, 0] },
                  { node: index("tailEnd") },
                ],
              },
            ],
          },
        }
      : {};
    json.extensions = {
      VRMC_vrm: {
        specVersion: "1.0",
        meta: { name: options.title ?? "Boxes", authors: ["the tests"], licenseUrl: "https://vrm.dev/licenses/1.0/" },
        humanoid: { humanBones: Object.fromEntries(humanBones.map((bone) => [bone, { node: index(bone) }])) },
      },
      ...springs,
    };
    json.extensionsUsed = [...Object.keys(json.extensions as object), "VRMC_materials_mtoon"];
  } else if (vrm === 0) {
    json.extensions = {
      VRM: {
        specVersion: "0.0",
        meta: { title: options.title ?? "Old boxes" },
        humanoid: { humanBones: humanBones.map((bone) => ({ bone: oldThumbName(bone), node: index(bone) })) },
        materialProperties: dressed ? [OLD_CARTOON] : [],
      },
    };
    json.extensionsUsed = ["VRM"];
  }
  return container(json, buffer);
}

/** VRM 0 describes materials separately. */
const OLD_CARTOON = {
  name: "cloth",
  shader: "VRM/MToon",
  renderQueue: 2000,
  keywordMap: {},
  tagMap: { RenderType: "Opaque" },
  textureProperties: { _MainTex: 0 },
  floatProperties: {
    _ShadeShift: 0,
    _ShadeToony: 0.9,
    _OutlineWidthMode: 1,
    _OutlineWidth: 0.1,
    _Cutoff: 0.5,
    _BlendMode: 0,
    _CullMode: 2,
    _ZWrite: 1,
  },
  vectorProperties: { _Color: [1, 1, 1, 1], _ShadeColor: [0.6, 0.5, 0.6, 1], _OutlineColor: [0.1, 0.1, 0.1, 1] },
};

/** Return texture coordinates for `count` vertices, four for each side of a box. */
function textureCoordinates(count: number): Float32Array {
  const corners = [0, 0, 1, 0, 1, 1, 0, 1];
  return Float32Array.from({ length: count * 2 }, (_, at) => corners[at % 8]);
}

/** Add the texture, and MToon colours for VRM 1. */
function addMaterials(json: Record<string, unknown>, vrm: 0 | 1 | undefined): void {
  json.images = [{ bufferView: (json.bufferViews as unknown[]).length - 1, mimeType: "image/png" }];
  json.textures = [{ source: 0 }];
  const [{ primitives }] = json.meshes as { primitives: { attributes: Record<string, number> }[] }[];
  primitives[0].attributes.TEXCOORD_0 = (json.accessors as unknown[]).length - 1;
  const [material] = json.materials as Record<string, unknown>[];
  Object.assign(material, {
    name: "cloth",
    pbrMetallicRoughness: { baseColorTexture: { index: 0 }, metallicFactor: 0 },
  });
  if (vrm === 1)
    material.extensions = {
      VRMC_materials_mtoon: {
        specVersion: "1.0",
        shadeColorFactor: [0.6, 0.5, 0.6],
        shadingToonyFactor: 0.9,
        outlineWidthMode: "worldCoordinates",
        outlineWidthFactor: 0.004,
        outlineColorFactor: [0.1, 0.1, 0.1],
      },
    };
}

/** Return VRM 0's name of a bone. */
function oldThumbName(bone: string): string {
  return bone.replace("ThumbProximal", "ThumbIntermediate").replace("ThumbMetacarpal", "ThumbProximal");
}
