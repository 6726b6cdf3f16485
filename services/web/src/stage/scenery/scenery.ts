/**
 * Scenery: backdrop and floor. It turns with a camera that circles the stage, since it has no back side; in the
 * audience view it does not turn.
 */
import { type Camera, Group, Vector2, Vector3, type WebGLRenderer } from "three";
import type { CameraView } from "../camera/view";
import { applyLookToBackdrop, createBackdrop, createBackdropUniforms } from "./backdrop";
import { BakedBackdrop } from "./baked-backdrop";
import { createBakedUniforms } from "./baked-uniforms";
import { createFloor, type Floor } from "./floor";
import type { Look } from "./look";
import { applyLookToVignette, createVignetteUniforms } from "./vignette";

/**
 * Angle of view to the side up to which nothing turns, in radians: slightly more than the orbit of the audience view.
 */
export const MAX_SIDE_ANGLE_RAD = (28 * Math.PI) / 180;
/** Rate of return in the audience view, in 1/s. */
const RETURN_RATE = 3;

const place = new Vector3();
const gaze = new Vector3();

export class Scenery {
  readonly group = new Group();
  readonly #backdropUniforms = createBackdropUniforms();
  readonly #vignette = createVignetteUniforms();
  readonly #baked = createBakedUniforms();
  readonly #backdrop = createBackdrop(this.#backdropUniforms, this.#vignette, this.#baked);
  readonly #bakedBackdrop = new BakedBackdrop(this.#backdropUniforms, this.#baked);
  readonly #floor: Floor;
  /** Distance that the boards have travelled relative to the scenery, in metres of its own scale. */
  readonly #boardOffset = new Vector2();

  /** `floorOffset` is the distance that the stage has travelled, which the boards show. */
  constructor(private readonly floorOffset = new Vector2()) {
    this.group.name = "scenery";
    const surroundings = { backdrop: this.#backdropUniforms, vignette: this.#vignette, baked: this.#baked };
    this.#floor = createFloor(surroundings, this.group, this.#boardOffset);
    this.group.add(this.#backdrop.mesh, this.#floor.mesh);
  }

  /** Draws with materials for machines without a graphics processor. */
  set usesSimpleMaterials(on: boolean) {
    this.#backdrop.usesSimpleMaterials = this.#floor.usesSimpleMaterials = on;
  }

  applyLook(look: Look): void {
    applyLookToBackdrop(this.#backdropUniforms, look);
    applyLookToVignette(this.#vignette, look);
    this.#floor.applyLook(look);
    this.invalidate();
  }

  /** Set the disc's radius and the height of its centre, in metres. */
  placeDisc(radius: number, height: number): void {
    this.#backdropUniforms.discRadius.value = radius;
    this.#backdropUniforms.discCentre.value.set(0, height);
    this.#backdrop.fitDisc();
    this.invalidate();
  }

  /** Draw textures again before the next frame that needs them. */
  invalidate(): void {
    this.#bakedBackdrop.invalidate();
  }

  /**
   * Draw the textures that the next frame needs. With `camera`, the one that it is drawn through, simple materials leave
   * out what it does not see. World matrices are up to date.
   */
  prepare(renderer: WebGLRenderer, camera?: Camera): void {
    if (!this.group.parent || !this.#backdrop.usesSimpleMaterials) return;
    this.#bakedBackdrop.update(renderer);
    if (camera)
      for (const { mesh, triangles } of [this.#backdrop, this.#floor]) triangles.cull(camera, mesh.matrixWorld);
  }

  dispose(): void {
    for (const part of [this.#backdrop, this.#bakedBackdrop, this.#floor]) part.dispose();
  }

  /**
   * Advance by `seconds`. The backdrop is behind the centre of an audience view moved by `sideOffset` metres, as if it
   * were far away; the boards stay where they are.
   */
  update(view: CameraView, isAudienceView: boolean, seconds: number, sideOffset = 0): void {
    const { position, scale, rotation, parent } = this.group;
    position.x = sideOffset;
    this.#boardOffset.copy(this.floorOffset).setX(this.floorOffset.x + sideOffset / scale.x);
    place.copy(view.position);
    gaze.copy(view.gaze);
    if (parent) for (const at of [place, gaze]) parent.worldToLocal(at);
    if (isAudienceView) rotation.y *= Math.exp(-RETURN_RATE * seconds);
    const viewAngle = Math.atan2(place.x - gaze.x, place.z - gaze.z) - rotation.y;
    const excess = Math.atan2(Math.sin(viewAngle), Math.cos(viewAngle));
    const angle = rotation.y + excess - Math.min(Math.max(excess, -MAX_SIDE_ANGLE_RAD), MAX_SIDE_ANGLE_RAD);
    rotation.y = Math.atan2(Math.sin(angle), Math.cos(angle));
  }
}
