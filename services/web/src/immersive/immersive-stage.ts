/**
 * The stage as an immersive session shows it: performers, strings, lights and scenery in their own world frame, around
 * the room of the viewer. It draws what it is given and reads no clock.
 */
import {
  CylinderGeometry,
  Group,
  type IUniform,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  Scene,
  Vector3,
  type WebGLRenderer,
} from "three";
import type { ImmersiveFrame } from "../engine/message";
import { FollowRig } from "../stage/camera/follow-rig";
import { PropGroup } from "../stage/props/prop-group";
import { type PerformerFactory, PerformerGroup } from "../stage/puppet/performer-group";
import { createEnvironmentMap } from "../stage/scenery/environment-map";
import { createLights } from "../stage/scenery/lighting";
import { LOOKS, type Look, type Theme } from "../stage/scenery/look";
import { Scenery } from "../stage/scenery/scenery";
import { Strings } from "../stage/strings/strings";
import { Placement, type StageSize } from "./placement";

/** Limits of what is seen, in metres of the stage. */
const NEAR_M = 0.08;
const FAR_M = 120;
/** Half the width that the lights cover for one performer, in metres. */
const LIT_HALF_WIDTH_M = 1.2;
/** Highest position of the control bars above the floor, in metres. */
const BAR_CEILING_M = 2.8;
/** Radius of the pedestal that carries a small stage, in metres of the stage. */
const PEDESTAL_RADIUS_M = 1.35;
/** Radius of the disc behind the performers and height of its centre, in metres. */
const DISC_M = [1.06, 1.3] as const;
/** Longest step of the stage's own movements, in seconds. */
const MAX_STEP_S = 0.1;

export interface ImmersiveStageOptions {
  readonly theme: Theme;
  readonly size: StageSize;
  /** Draw without reflections of surroundings, shadows and fine geometry. */
  readonly isSimple: boolean;
  readonly reducedMotion: boolean;
}

export class ImmersiveStage {
  readonly scene = new Scene();
  /** The room of the viewer, in metres: camera, hands and messages are in it. */
  readonly room = new Group();
  readonly camera = new PerspectiveCamera(60, 1, NEAR_M, FAR_M);
  readonly placement: Placement;
  readonly strings = new Strings();
  readonly #floorHeight: IUniform<number> = { value: 0 };
  readonly #performerGroup = new PerformerGroup(this.#floorHeight);
  readonly #propGroup = new PropGroup();
  readonly #rig = new FollowRig();
  readonly #lights = createLights();
  readonly #scenery = new Scenery();
  /** The scenery's frame: as large as life, around the stage in the room. */
  readonly #hall = new Group();
  readonly #pedestal: Mesh<CylinderGeometry, MeshStandardMaterial>;
  readonly #look: Look;
  #front = 0;
  #isPlaced = false;
  #performer = 0;
  #size: StageSize;

  /** `renderer` does not present a session yet: textures are drawn with it first. */
  constructor(
    readonly renderer: WebGLRenderer,
    private readonly options: ImmersiveStageOptions,
  ) {
    const { theme, size, isSimple, reducedMotion } = options;
    this.#size = size;
    this.placement = new Placement(size);
    this.strings.reducedMotion = reducedMotion;
    // A vignette is a property of a picture, not of a room.
    this.#look = { ...LOOKS[theme], vignette: { ...LOOKS[theme].vignette, strength: 0 } };
    const look = this.#look;
    this.#pedestal = new Mesh(
      new CylinderGeometry(PEDESTAL_RADIUS_M, PEDESTAL_RADIUS_M, 1, 48).translate(0, -0.5, 0),
      new MeshStandardMaterial({ color: look.floor.colour, roughness: look.floor.roughness }),
    );
    this.#pedestal.receiveShadow = true;
    this.#pedestal.frustumCulled = false;
    // The reflecting floor costs too much for two eyes.
    this.#scenery.usesSimpleMaterials = true;
    this.#scenery.applyLook(look);
    this.#scenery.placeDisc(...DISC_M);
    this.#scenery.group.traverse((part) => (part.frustumCulled = false));
    this.#hall.add(this.#scenery.group);
    this.#scenery.prepare(renderer);
    this.#lights.applyLook(look);
    this.#rig.group.add(this.#lights.group);
    this.room.add(this.camera);
    for (const object of [this.room, this.camera]) object.matrixAutoUpdate = false;
    this.scene.add(
      this.#rig.group,
      this.#hall,
      this.#pedestal,
      this.#performerGroup.group,
      this.#propGroup.group,
      this.strings.group,
      this.room,
    );
    // They are updated before the cameras, which depend on them.
    this.scene.matrixWorldAutoUpdate = false;
    renderer.toneMappingExposure = look.exposure;
    renderer.setClearColor(look.backdrop.middle);
    if (!isSimple) this.scene.environment = createEnvironmentMap(renderer, look);
    this.#applyQuality(isSimple);
  }

  /** Draw with less detail from now on. */
  simplify(): void {
    this.scene.environment?.dispose();
    this.scene.environment = null;
    this.#applyQuality(true);
  }

  /** Size of the stage. Another one is placed anew in front of the viewer, as soon as no hand pulls a limb. */
  get size(): StageSize {
    return this.#size;
  }

  set size(size: StageSize) {
    this.#size = size;
  }

  /**
   * Show a frame, `interval` seconds after the last one, to a viewer whose pose in the room is the camera's.
   * `canMove` is false while the stage must stay where it is, as a hand pulls a limb.
   */
  apply(
    { figures, front, poses, strings, lights, props, performer }: ImmersiveFrame,
    interval: number,
    canMove: boolean,
  ): void {
    const seconds = Math.min(interval, MAX_STEP_S);
    if (figures && this.#performerGroup.setFigures(figures)) {
      this.#rig.reset(front);
      this.#isPlaced = false;
    }
    this.#front = front;
    this.#performerGroup.apply(poses, this.options.reducedMotion ? 0 : seconds);
    const { performers, visiblePerformers } = this.#performerGroup;
    if (visiblePerformers.length === 0) return;
    this.#rig.follow(visiblePerformers, seconds);
    this.#floorHeight.value = this.#rig.group.position.y;
    const isNew = this.#propGroup.update(
      props,
      performers,
      this.#floorHeight.value,
      this.options.reducedMotion ? Infinity : seconds,
    );
    if (isNew) this.renderer.compile(this.scene, this.camera);
    const spot = new Vector3().setFromMatrixPosition((performers[performer] ?? visiblePerformers[0]).root);
    this.#place(spot, performer, canMove);
    this.#rig.group.updateMatrixWorld(true);
    this.#lights.update(lights, this.options.reducedMotion ? Infinity : seconds, this.#litWidth());
    this.scene.environmentIntensity = this.#look.environment * this.#lights.ambientLevel;
    this.strings.update(
      performers.map((one) => (one.group.visible ? one : null)),
      strings.map((string) => ({ ...string, pullTarget: string.pullTarget && new Vector3(...string.pullTarget) })),
      this.#look,
      seconds,
      {
        ground: this.#floorHeight.value,
        ceiling: this.#floorHeight.value + BAR_CEILING_M,
        right: new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0).setY(0).normalize(),
        distanceScale: 1,
      },
    );
  }

  /** Set the factory of a performer (an index); null restores the puppet. */
  setPerformerFactory(factory: PerformerFactory | null, performer = 0): void {
    this.#performerGroup.setPerformerFactory(factory, performer);
    if (factory) this.renderer.compile(this.scene, this.camera);
  }

  /** Position of a limb's ring, null if its performer is not shown. */
  ringOf(limb: number): Vector3 | null {
    return this.#performerGroup.handles[limb] ?? null;
  }

  /** Update all transforms before a frame is drawn. */
  updateMatrices(): void {
    const { placement } = this;
    this.room.matrix.copy(placement.matrix);
    const scale = placement.stagePerRoom;
    const depth = placement.floorHeight * scale;
    const { x, y, z } = placement.centre;
    this.#hall.position.set(x, y - depth, z);
    this.#hall.rotation.y = this.#front;
    this.#hall.scale.setScalar(scale);
    this.#pedestal.visible = depth > 0;
    this.#pedestal.position.set(x, y, z);
    this.#pedestal.scale.set(1, Math.max(depth, 1e-3), 1);
    this.scene.updateMatrixWorld();
    this.#performerGroup.prepare(this.renderer, this.scene, this.camera, this.#look);
  }

  /** Release all graphics resources but those of the renderer. */
  dispose(): void {
    this.#performerGroup.dispose();
    this.#propGroup.dispose();
    this.#scenery.dispose();
    this.#pedestal.geometry.dispose();
    this.#pedestal.material.dispose();
    this.scene.environment?.dispose();
  }

  #applyQuality(isSimple: boolean): void {
    this.#lights.castsShadows = !isSimple;
    this.#performerGroup.setQuality(false, isSimple);
    this.#propGroup.usesSimpleMaterials = isSimple;
    this.renderer.compile(this.scene, this.camera);
  }

  /** Keep the stage in front of the viewer: it stands still, unless the selected performer is elsewhere. */
  #place(spot: Vector3, performer: number, canMove: boolean): void {
    const { placement } = this;
    placement.setGround(this.#floorHeight.value);
    if (!this.#isPlaced || (canMove && placement.size !== this.#size)) {
      placement.size = this.#size;
      placement.place(this.camera.matrix, { centre: spot.setY(this.#floorHeight.value), front: this.#front });
      this.#isPlaced = true;
    } else if (canMove && (performer !== this.#performer || placement.isFar(spot))) placement.moveTo(spot);
    this.#performer = performer;
  }

  /** Return the width that the lights cover, as a multiple of what one performer needs. */
  #litWidth(): number {
    const { group } = this.#rig;
    const offsets = this.#performerGroup.visiblePerformers.map(({ root }) =>
      Math.abs(group.worldToLocal(new Vector3().setFromMatrixPosition(root)).x),
    );
    return Math.max(1, Math.max(...offsets) / LIT_HALF_WIDTH_M);
  }
}
