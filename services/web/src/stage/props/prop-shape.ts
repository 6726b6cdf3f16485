/** Shapes of the built-in props by kind. */

import type { PropKind } from "../../motion/props";
import { createBall } from "./ball";
import { createBranch } from "./branch";
import { createFan } from "./fan";
import type { PropMesh } from "./prop-mesh";
import { createUmbrella } from "./umbrella";

const CREATORS: Readonly<Record<PropKind, () => PropMesh>> = {
  fan: createFan,
  umbrella: createUmbrella,
  ball: createBall,
  branch: createBranch,
};

/** Return the shape of a prop in its own frame. */
export function createPropShape(kind: PropKind): PropMesh {
  return CREATORS[kind]();
}
