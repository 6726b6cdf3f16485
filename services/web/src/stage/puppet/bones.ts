/** Bones of the puppet, by the names of their joints. */
import { JOINTS } from "../../motion/skeleton";
import { FINGER_BONES } from "./hand/finger-joints";

/** Bones of the puppet's trunk beside those of the figure; without an extension they follow vl5. */
export const TRUNK_BONES: readonly string[] = ["chest", "neck", "l_clavicle", "r_clavicle"];

/** Bone without a place: its matrix has the expression of the face, which the shader reads. */
export const FACE_BONE = "face";

/**
 * Bones in the order of the geometry's skin indices: the joints of the contract, the two sleeves, the trunk's, the
 * fingers', and the face's.
 */
export const BONES: readonly string[] = [...JOINTS, "l_sleeve", "r_sleeve", ...TRUNK_BONES, ...FINGER_BONES, FACE_BONE];
