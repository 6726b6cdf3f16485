/** Model of a prop: its mesh and its form. */
import type { PropForm } from "./props";

/** Vertices and triangles in the frame of the prop: three numbers per vertex for each attribute. */
export interface PropShape {
  /** Metres. */
  readonly positions: ArrayLike<number>;
  readonly normals: ArrayLike<number>;
  /** Linear RGB. */
  readonly colours: ArrayLike<number>;
  /** Roughness, metalness and clearcoat. */
  readonly finishes: ArrayLike<number>;
  /** At most 65,535. */
  readonly indices: ArrayLike<number>;
}

export interface PropModel {
  readonly form: PropForm;
  readonly shape: PropShape;
}
