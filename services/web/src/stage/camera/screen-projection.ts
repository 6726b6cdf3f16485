/** Projection between world positions and a picture of the scene in CSS pixels. */
import { type PerspectiveCamera, Plane, Ray, Vector3 } from "three";
import { projectBox, type ScreenBox, type WorldExtent } from "./screen-box";

/** Position in the picture, in CSS pixels from the upper left corner. */
export interface ScreenPosition {
  x: number;
  y: number;
}

export class ScreenProjection {
  width = 1;
  height = 1;
  readonly #camera: PerspectiveCamera;

  constructor(camera: PerspectiveCamera) {
    this.#camera = camera;
  }

  /** Return the position in the picture of a world position. */
  toScreen(position: Vector3): ScreenPosition {
    const clip = position.clone().project(this.#camera);
    return { x: (clip.x * 0.5 + 0.5) * this.width, y: (0.5 - clip.y * 0.5) * this.height };
  }

  /**
   * Return the world position of a pixel on the plane through `through` that faces the camera; null if it is behind the
   * camera.
   */
  fromScreen(x: number, y: number, through: Vector3): Vector3 | null {
    const eye = new Vector3().setFromMatrixPosition(this.#camera.matrixWorld);
    const clip = new Vector3((x / this.width) * 2 - 1, 1 - (y / this.height) * 2, 0.5);
    const ray = new Ray(eye, clip.unproject(this.#camera).sub(eye).normalize());
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.#camera.getWorldDirection(new Vector3()), through);
    return ray.intersectPlane(plane, new Vector3());
  }

  /** Return the box in the picture around a world position. */
  boxAt(position: Vector3, { across, up, down }: WorldExtent, scale: number): ScreenBox {
    const extent = { across: across * scale, up: up * scale, down: down * scale };
    return projectBox(position, extent, this.#camera, this.width, this.height);
  }
}
