/** Build of the pose detector. */
import type { Plugin } from "vite";

const EMPTY = "\0empty";

/** Leaves out the modules of Node that the detector imports where it runs there. */
export const poseModules: Plugin = {
  name: "pose-modules",
  enforce: "pre",
  resolveId: { filter: { id: /^(fs|path)$/ }, handler: () => EMPTY },
  load: { filter: { id: /^\0empty$/ }, handler: () => "export default {};" },
};
