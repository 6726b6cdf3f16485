/** Bundle of everything that exports motions as files, loaded at the first export. */
export { downloadMotion } from "../client/motion-download";
export { exportFile } from "../export/export-file";
export { fileName } from "../export/file-name";
