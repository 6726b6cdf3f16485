/** Everything that makes files of dances, in one piece: fetched when somebody first wants one. */
export { bestBlocks } from "./client/best-blocks";
export { makeFile } from "./export/file";
export { fileName } from "./export/file-name";
