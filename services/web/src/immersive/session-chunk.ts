/** Bundle of an immersive session: what only it needs of three.js and of the stage, loaded after the click. */
export { ImmersiveSession } from "./immersive-session";
