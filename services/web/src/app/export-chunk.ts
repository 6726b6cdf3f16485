/** Everything that makes files of dances, in one piece: fetched when somebody first wants one. */
export { downloadMotion as bestBlocks } from "../client/motion-download";
export { exportFile as makeFile } from "../export/export-file";
export { fileName } from "../export/file-name";
