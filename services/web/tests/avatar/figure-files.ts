/** Writer of GLB and VRM files with figures of boxes on bones, in various rest poses, axes, units and names. */
import { Euler, Matrix4, Quaternion, Vector3 } from "three";

export interface FigureOptions {
  /** Angle of the arms below level and of the legs from vertical, in degrees. */
  arms?: number;
  legs?: number;
  /** Facing, as a rotation about y from z in degrees. */
  facing?: number;
  /** Metres per unit of the file: 0.01 for centimetres, with a scaled root node as tools write it. */
  unit?: number;
  /** Give bones arbitrary local axes. */
  askew?: boolean;
  /** Length of legs and forearms relative to an adult's. */
  legLength?: number;
  forearm?: number;
  /** Return the name of a bone's node. */
  name?: (bone: string) => string;
  vrm?: 1 | 0;
  without?: readonly string[];
  /** Add a tail with spring bones (VRM 1). */
  tail?: boolean;
  /** Add a texture, and MToon materials if the file is a VRM. */
  dressed?: boolean;
  /** Lay the figure on its back, as tools with z up may. */
  lying?: boolean;
}

interface Bone {
  name: string;
  parent: string | null;
  /** From the parent in the T-pose, in metres. */
  offset: Vector3;
  /** End of its box, relative to it. */
  end: Vector3;
}

const at = (x: number, y: number, z: number) => new Vector3(x, y, z);

/** Image of two by two pixels, PNG. */
const PNG_BASE64 =
  "iVBORw0KGgoAAAANSUhEUgAAAAIAAAACCAYAAABytg0kAAAAEUlEQVR42mOIWnDiPwgzwBgAXwgLBRyxh08AAAAASUVORK5CYII=";

/** Return the bones of an adult of 1.65 m in the T-pose, facing z; parents first. */
function bonesOf({ legLength = 1, forearm = 1, without = [], tail = false }: FigureOptions): Bone[] {
  const bones: Bone[] = [
    { name: "hips", parent: null, offset: at(0, 0.06 + 0.86 * legLength, 0), end: at(0, 0.1, 0) },
    { name: "spine", parent: "hips", offset: at(0, 0.09, -0.01), end: at(0, 0.11, 0) },
    { name: "chest", parent: "spine", offset: at(0, 0.12, 0), end: at(0, 0.2, 0) },
    { name: "neck", parent: "chest", offset: at(0, 0.24, -0.01), end: at(0, 0.08, 0) },
    { name: "head", parent: "neck", offset: at(0, 0.09, 0.01), end: at(0, 0.2, 0) },
  ];
  for (const [side, x] of [
    ["left", 1],
    ["right", -1],
  ] as const) {
    bones.push(
      { name: `${side}Shoulder`, parent: "chest", offset: at(0.04 * x, 0.18, 0), end: at(0.1 * x, 0, 0) },
      { name: `${side}UpperArm`, parent: `${side}Shoulder`, offset: at(0.12 * x, 0, 0), end: at(0.26 * x, 0, 0) },
      {
        name: `${side}LowerArm`,
        parent: `${side}UpperArm`,
        offset: at(0.26 * x, 0, 0),
        end: at(0.24 * forearm * x, 0, 0),
      },
      { name: `${side}Hand`, parent: `${side}LowerArm`, offset: at(0.24 * forearm * x, 0, 0), end: at(0.17 * x, 0, 0) },
      { name: `${side}MiddleProximal`, parent: `${side}Hand`, offset: at(0.08 * x, 0, 0), end: at(0.09 * x, 0, 0) },
      { name: `${side}UpperLeg`, parent: "hips", offset: at(0.09 * x, -0.06, 0), end: at(0, -0.41 * legLength, 0) },
      {
        name: `${side}LowerLeg`,
        parent: `${side}UpperLeg`,
        offset: at(0, -0.41 * legLength, 0),
        end: at(0, -0.39 * legLength, 0),
      },
      {
        name: `${side}Foot`,
        parent: `${side}LowerLeg`,
        offset: at(0, -0.39 * legLength, -0.02),
        end: at(0, -0.06 * legLength, 0.14),
      },
      { name: `${side}Toes`, parent: `${side}Foot`, offset: at(0, -0.05 * legLength, 0.13), end: at(0, 0, 0.07) },
    );
  }
  if (tail)
    bones.push(
      { name: "tail", parent: "hips", offset: at(0, 0, -0.08), end: at(0, 0, -0.3) },
      { name: "tailEnd", parent: "tail", offset: at(0, 0, -0.3), end: at(0, 0, -0.02) },
    );
  return bones
    .filter(({ name }) => !without.includes(name))
    .map((bone) => ({ ...bone, parent: bone.parent && without.includes(bone.parent) ? "hips" : bone.parent }));
}

/** Return the rotation of a bone from the T-pose about z, in radians. */
function bend(name: string, { arms = 0, legs = 0 }: FigureOptions): number {
  const sign = name.startsWith("left") ? 1 : -1;
  if (/UpperArm|LowerArm|Hand|MiddleProximal/.test(name)) return (-sign * arms * Math.PI) / 180;
  return /UpperLeg|LowerLeg/.test(name) ? (sign * legs * Math.PI) / 180 : 0;
}

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
    box(from, tip, thickness, positions, normals, indices, /Foot|Toes/.test(bone.name) ? 0 : null);
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
        meta: { name: "Boxes", authors: ["the tests"], licenseUrl: "https://vrm.dev/licenses/1.0/" },
        humanoid: { humanBones: Object.fromEntries(humanBones.map((bone) => [bone, { node: index(bone) }])) },
      },
      ...springs,
    };
    json.extensionsUsed = [...Object.keys(json.extensions as object), "VRMC_materials_mtoon"];
  } else if (vrm === 0) {
    json.extensions = {
      VRM: {
        specVersion: "0.0",
        meta: { title: "Old boxes" },
        humanoid: { humanBones: humanBones.map((bone) => ({ bone, node: index(bone) })) },
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

/** Add the texture, and MToon colours for VRM 1. */
function addMaterials(json: Record<string, unknown>, vrm: 0 | 1 | undefined): void {
  json.images = [{ bufferView: (json.bufferViews as unknown[]).length - 1, mimeType: "image/png" }];
  json.textures = [{ source: 0 }];
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

/** Add a box around the segment between two points; with `floor` it extends down to that height. */
function box(
  from: Vector3,
  to: Vector3,
  thickness: number,
  positions: number[],
  normals: number[],
  indices: number[],
  floor: number | null,
): void {
  const along = to.clone().sub(from);
  const turn = new Quaternion().setFromUnitVectors(at(0, 1, 0), along.clone().normalize());
  for (const axis of [0, 1, 2]) {
    for (const sign of [1, -1]) {
      const first = positions.length / 3;
      const normal = at(0, 0, 0).setComponent(axis, sign);
      for (const [u, v] of [
        [-1, -1],
        [1, -1],
        [1, 1],
        [-1, 1],
      ]) {
        const corner = at(0, 0, 0)
          .setComponent(axis, sign)
          .setComponent((axis + 1) % 3, sign * u)
          .setComponent((axis + 2) % 3, v);
        const place = at(corner.x * thickness, ((corner.y + 1) / 2) * along.length(), corner.z * thickness)
          .applyQuaternion(turn)
          .add(from);
        if (floor !== null && place.y < (from.y + floor) / 2) place.y = floor;
        positions.push(...place.toArray());
        normals.push(...normal.clone().applyQuaternion(turn).toArray());
      }
      indices.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
  }
}

type Part = readonly [
  values: Float32Array | Uint8Array | Uint16Array,
  type: "SCALAR" | "VEC3" | "VEC4" | "MAT4",
  target: number | undefined,
];

const WIDTHS = { SCALAR: 1, VEC3: 3, VEC4: 4, MAT4: 16 };

/** Concatenate the parts, followed by an image that has a view only. */
function pack(
  parts: readonly Part[],
  picture: Uint8Array,
): { buffer: Uint8Array; views: unknown[]; accessors: unknown[] } {
  const views: unknown[] = [];
  const accessors: unknown[] = [];
  const bytes: number[] = [];
  for (const [values, type, target] of parts) {
    views.push({ buffer: 0, byteOffset: bytes.length, byteLength: values.byteLength, ...(target ? { target } : {}) });
    const width = WIDTHS[type];
    const bounds =
      type === "VEC3"
        ? {
            min: [0, 1, 2].map((k) => extreme(values, k, Math.min)),
            max: [0, 1, 2].map((k) => extreme(values, k, Math.max)),
          }
        : {};
    const componentType = values instanceof Float32Array ? 5126 : values instanceof Uint16Array ? 5123 : 5121;
    accessors.push({ bufferView: views.length - 1, componentType, count: values.length / width, type, ...bounds });
    for (const byte of new Uint8Array(values.buffer)) bytes.push(byte);
    while (bytes.length % 4) bytes.push(0);
  }
  views.push({ buffer: 0, byteOffset: bytes.length, byteLength: picture.length });
  bytes.push(...picture);
  while (bytes.length % 4) bytes.push(0);
  return { buffer: new Uint8Array(bytes), views, accessors };
}

function extreme(values: ArrayLike<number>, axis: number, of: (a: number, b: number) => number): number {
  let found = values[axis];
  for (let i = axis; i < values.length; i += 3) found = of(found, values[i]);
  return found;
}

function container(json: unknown, buffer: Uint8Array): Uint8Array<ArrayBuffer> {
  const text = new TextEncoder().encode(JSON.stringify(json));
  const padded = Math.ceil(text.length / 4) * 4;
  const bytes = new Uint8Array(28 + padded + buffer.length);
  const view = new DataView(bytes.buffer);
  [0x46546c67, 2, bytes.length, padded, 0x4e4f534a].forEach((word, k) => view.setUint32(4 * k, word, true));
  bytes.fill(0x20, 20, 20 + padded).set(text, 20);
  view.setUint32(20 + padded, buffer.length, true);
  view.setUint32(24 + padded, 0x004e4942, true);
  bytes.set(buffer, 28 + padded);
  return bytes;
}

/** Return the name of a Mixamo bone. */
export function mixamoName(bone: string): string {
  const side = bone.startsWith("left") ? "Left" : bone.startsWith("right") ? "Right" : "";
  const words: Record<string, string> = {
    hips: "Hips",
    spine: "Spine",
    chest: "Spine1",
    neck: "Neck",
    head: "Head",
    Shoulder: "Shoulder",
    UpperArm: "Arm",
    LowerArm: "ForeArm",
    Hand: "Hand",
    MiddleProximal: "HandMiddle1",
    UpperLeg: "UpLeg",
    LowerLeg: "Leg",
    Foot: "Foot",
    Toes: "ToeBase",
  };
  const word = words[bone.slice(side.length)];
  if (!word) throw new Error(`Mixamo has no ${bone}`);
  return `mixamorig:${side}${word}`;
}
