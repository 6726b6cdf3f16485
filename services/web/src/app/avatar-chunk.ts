/** Everything that stands on three-vrm, in one piece: it comes with the first avatar. */
export { Avatar } from "../avatar/avatar";
export { AvatarModel } from "../avatar/model";
