/** Bundle of everything that depends on three-vrm, loaded with the first avatar. */
import { restoreShaders } from "../avatar/shaders";

export { nameOfFile } from "../avatar/author-name";
export { Avatar } from "../avatar/avatar";
export { AvatarModel } from "../avatar/model";

restoreShaders();
