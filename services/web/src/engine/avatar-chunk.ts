/** Bundle of everything that depends on three-vrm, loaded with the first avatar. */
export { Avatar } from "../avatar/avatar";
export { AvatarModel } from "../avatar/model";
