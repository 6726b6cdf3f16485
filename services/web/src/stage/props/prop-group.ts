/**
 * Props on the stage: in the hands of the performers, or on the floor. A prop that is taken, passed or laid down moves
 * there within a short time. Loaded with the first prop.
 */
import {
  BufferGeometry,
  type Camera,
  Float32BufferAttribute,
  Group,
  type Material,
  Matrix4,
  Mesh,
  Quaternion,
  Sphere,
  Uint16BufferAttribute,
  Vector3,
} from "three";
import type { Access } from "../../client/access";
import type { StagedPose } from "../../motion/extension";
import type { PropModel, PropShape } from "../../motion/prop-model";
import { PropMovement } from "../../motion/prop-movement";
import { createPropTransform, GRIP_SHARE, heldTransform, laidTransform, type PropTransform } from "../../motion/props";
import { limbWithinPerformer, performerOfLimb } from "../../wire/limbs";
import type { PropPresence } from "../../wire/messages";
import type { ScreenBox } from "../camera/screen-box";
import type { ScreenProjection } from "../camera/screen-projection";
import type { Performer } from "../puppet/performer";
import { type FormedProp, PropGrip } from "./prop-grip";
import { createPropMaterial, SimplePropMaterial } from "./prop-material";
import { PropModels } from "./prop-models";

/** Factor of a prop's radius for its near side, which is larger in the picture. */
const NEARNESS = 1.15;
/** Largest share of a picture's half height that props in hands take before the camera moves back. */
const TOP_SHARE = 0.8;

/** A prop that is drawn. */
interface DrawnProp {
  readonly mesh: Mesh<BufferGeometry, Material>;
  readonly movement: PropMovement;
  isHeld: boolean;
}

export class PropGroup {
  readonly group = new Group();
  readonly #models: PropModels;
  readonly #props = new Map<string, DrawnProp>();
  /** Geometries of the kinds that are drawn. */
  readonly #geometries = new Map<string, BufferGeometry>();
  /** Index: performer. */
  readonly #grips: PropGrip[] = [];
  readonly #material = createPropMaterial();
  readonly #simpleMaterial = new SimplePropMaterial();
  #usesSimpleMaterials = false;

  /** `access` is that to the server with the stored props; that of the page by default. */
  constructor(access?: Access) {
    this.#models = new PropModels(access);
    this.group.name = "props";
  }

  set usesSimpleMaterials(on: boolean) {
    this.#usesSimpleMaterials = on;
    for (const { mesh } of this.#props.values()) mesh.material = this.#currentMaterial;
  }

  /** Return the poses of the performers with their hands closed around what they hold; `seconds` as for `update`. */
  closeHands(
    poses: readonly (StagedPose | null)[],
    props: readonly PropPresence[],
    seconds: number,
  ): readonly (StagedPose | null)[] {
    const drawn = this.#drawable(props);
    return poses.map((pose, performer) => {
      this.#grips[performer] ??= new PropGrip();
      this.#grips[performer].update(drawn, performer, seconds);
      return pose && this.#grips[performer].apply(pose);
    });
  }

  /**
   * Show the props that there are now, with the performers in their poses and the floor at `floorHeight`, `seconds`
   * after the last call; with Infinity nothing eases. Props of unknown kinds, those whose model is not loaded, and those
   * whose performer is not seen are not drawn. Return true if a kind has come: its shader is to be compiled.
   */
  update(
    props: readonly PropPresence[],
    performers: readonly Performer[],
    floorHeight: number,
    seconds: number,
  ): boolean {
    let hasNewKind = false;
    const shown = new Set<string>();
    for (const prop of this.#drawable(props)) {
      const key = `${prop.prop} ${prop.kind}`;
      shown.add(key);
      hasNewKind ||= !this.#geometries.has(prop.kind);
      const drawn = this.#props.get(key) ?? this.#add(key, prop.kind, prop.shape);
      const place = transformOf(prop, performers, floorHeight);
      drawn.mesh.visible = place !== null;
      drawn.isHeld = prop.limb !== null;
      if (place) moveMesh(drawn.mesh, drawn.movement.moveTo(place, prop, seconds));
      else drawn.movement.hide();
    }
    for (const [key, { mesh }] of this.#props)
      if (!shown.has(key)) {
        mesh.removeFromParent();
        this.#props.delete(key);
      }
    this.#dropUnused(new Set(props.map(({ kind }) => kind)));
    return hasNewKind;
  }

  /** Return the boxes of the props in the picture, in CSS pixels. */
  boxes(projection: ScreenProjection): ScreenBox[] {
    return this.#visible.map(({ mesh }) => {
      const { center, radius } = sphereOf(mesh);
      return projection.boxAt(center, { across: radius, up: radius, down: radius }, NEARNESS);
    });
  }

  /** Return how far the props in hands reach from the centre of the picture (0) to its edges (1). */
  reach(camera: Camera): number {
    const right = new Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
    const up = new Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
    const shares = this.#visible.flatMap(({ mesh, isHeld }) => {
      if (!isHeld) return [];
      const { center, radius } = sphereOf(mesh);
      const project = (direction: Vector3, sign: number) =>
        center
          .clone()
          .addScaledVector(direction, sign * radius)
          .project(camera);
      return [Math.abs(project(right, 1).x), Math.abs(project(right, -1).x), project(up, 1).y * TOP_SHARE];
    });
    return Math.max(0, ...shares);
  }

  dispose(): void {
    for (const geometry of this.#geometries.values()) geometry.dispose();
    for (const material of [this.#material, this.#simpleMaterial]) material.dispose();
    this.group.removeFromParent();
  }

  get #visible(): DrawnProp[] {
    return [...this.#props.values()].filter(({ mesh }) => mesh.visible);
  }

  get #currentMaterial(): Material {
    return this.#usesSimpleMaterials ? this.#simpleMaterial : this.#material;
  }

  /** Return the props whose models are there, with these. The others begin to load. */
  #drawable(props: readonly PropPresence[]): (FormedProp & PropModel)[] {
    return props.flatMap((prop) => {
      const model = this.#models.get(prop.kind);
      return model ? [{ ...prop, ...model }] : [];
    });
  }

  #add(key: string, kind: string, shape: PropShape): DrawnProp {
    const mesh = new Mesh<BufferGeometry, Material>(this.#geometryFor(kind, shape), this.#currentMaterial);
    mesh.name = kind;
    mesh.castShadow = true;
    mesh.receiveShadow = true;
    mesh.matrixAutoUpdate = false;
    mesh.onBeforeRender = (_renderer, scene, _camera, _geometry, material) => {
      if (material instanceof SimplePropMaterial) material.prepare(scene);
    };
    this.group.add(mesh);
    const drawn = { mesh, movement: new PropMovement(), isHeld: false };
    this.#props.set(key, drawn);
    return drawn;
  }

  #geometryFor(kind: string, { positions, normals, colours, finishes, indices }: PropShape): BufferGeometry {
    const known = this.#geometries.get(kind);
    if (known) return known;
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(positions, 3));
    geometry.setAttribute("normal", new Float32BufferAttribute(normals, 3));
    geometry.setAttribute("color", new Float32BufferAttribute(colours, 3));
    geometry.setAttribute("finish", new Float32BufferAttribute(finishes, 3));
    geometry.setIndex(new Uint16BufferAttribute(indices, 1));
    geometry.computeBoundingSphere();
    this.#geometries.set(kind, geometry);
    return geometry;
  }

  /** Drop what kinds other than these took. */
  #dropUnused(used: ReadonlySet<string>): void {
    this.#models.retain(used);
    for (const [kind, geometry] of this.#geometries)
      if (!used.has(kind)) {
        geometry.dispose();
        this.#geometries.delete(kind);
      }
  }
}

/** Return where a prop belongs, null if its performer is not seen. The next call reuses the storage. */
function transformOf(
  { form, limb, place }: FormedProp,
  performers: readonly Performer[],
  floorHeight: number,
): PropTransform | null {
  if (limb === null) return laidTransform(form, place, floorHeight, transform);
  const performer = performers[performerOfLimb(limb)];
  if (!performer?.group.visible) return null;
  const hand = limbWithinPerformer(limb);
  performer.hand(hand, GRIP_SHARE, matrix);
  position.setFromMatrixPosition(matrix).toArray(grip.position);
  const { x, y, z, w } = rotation.setFromRotationMatrix(matrix);
  grip.rotation.set([w, x, y, z]);
  return heldTransform(form, hand, grip, transform);
}

function moveMesh(mesh: Mesh, place: PropTransform): void {
  const [w, x, y, z] = place.rotation;
  mesh.matrix.compose(position.fromArray(place.position), rotation.set(x, y, z, w), ONE);
  mesh.matrixWorldNeedsUpdate = true;
}

function sphereOf({ geometry, matrix: place }: Mesh<BufferGeometry, Material>): Sphere {
  return sphere.copy(geometry.boundingSphere ?? new Sphere()).applyMatrix4(place);
}

const ONE = new Vector3(1, 1, 1);
const transform = createPropTransform();
const grip = createPropTransform();
const matrix = new Matrix4();
const position = new Vector3();
const rotation = new Quaternion();
const sphere = new Sphere();
