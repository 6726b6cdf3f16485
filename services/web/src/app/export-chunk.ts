/** Bundle of everything that exports motions as files, loaded at the first export. */
export { fileName } from "../export/file-name";
export { exportMotion } from "./motion-export";
