/** Shapes of the props by kind. */
import type { PropKind } from "../../motion/props";
import { createBall } from "./ball";
import { createBranch } from "./branch";
import { createFan } from "./fan";
import type { PropShape } from "./prop-mesh";
import { createUmbrella } from "./umbrella";

const CREATORS: Readonly<Record<PropKind, () => PropShape>> = {
  fan: createFan,
  umbrella: createUmbrella,
  ball: createBall,
  branch: createBranch,
};

/** Return the shape of a prop in its own frame. */
export function createPropShape(kind: PropKind): PropShape {
  return CREATORS[kind]();
}
