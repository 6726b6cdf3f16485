/** Eyes of an avatar as bones: those of a VRM humanoid, or joints of the head that are named so. */
import { Euler, Mesh, type Object3D, Quaternion } from "three";
import { EYE_PITCH_RAD, EYE_YAW_RAD, type Gaze } from "../../motion/gaze";
import { splitWords } from "../naming/joint-name";
import { SIDE_WORDS } from "../naming/naming-profile";

/** Words of joints around an eye, which do not turn with it. */
const OTHER_WORDS = "lid lids brow brows lash lashes upper lower socket target aim look end nub tip ik".split(" ");
const EYE_WORDS = ["eye", "eyeball"];
const JAPANESE_EYES = { left: "左目", right: "右目" };

/** A bone that turns with the gaze. Create it while the model is at rest and faces z. */
export class EyeBone {
  readonly #rest: Quaternion;
  readonly #parent: Quaternion;

  constructor(private readonly node: Object3D) {
    this.#rest = node.quaternion.clone();
    this.#parent = (node.parent ?? node).getWorldQuaternion(new Quaternion());
  }

  turn({ yaw, pitch }: Gaze): void {
    euler.set(
      -Math.min(Math.max(pitch, -EYE_PITCH_RAD), EYE_PITCH_RAD),
      Math.min(Math.max(yaw, -EYE_YAW_RAD), EYE_YAW_RAD),
      0,
      "YXZ",
    );
    rotation.setFromEuler(euler).multiply(this.#parent).premultiply(inverse.copy(this.#parent).invert());
    this.node.quaternion.copy(rotation).multiply(this.#rest);
  }

  reset(): void {
    this.node.quaternion.copy(this.#rest);
  }
}

const euler = new Euler();
const rotation = new Quaternion();
const inverse = new Quaternion();

/** Return the eyes of a model at rest that faces z, left and right; empty if it does not have both. */
export function findEyeBones(nodes: ReadonlyMap<string, Object3D>): EyeBone[] {
  const head = nodes.get("head");
  const found = (["left", "right"] as const).map((side, index) => {
    let named = nodes.get(`${side}Eye`) ?? null;
    head?.traverse((node) => {
      if (!named && node !== head && isEye(node, index)) named = node;
    });
    return named;
  });
  return found.every((node) => node !== null) ? found.map((node) => new EyeBone(node)) : [];
}

/** Return whether a node is named as the eye of a side. */
function isEye(node: Object3D, side: number): boolean {
  if (node instanceof Mesh) return false;
  // The loader removes punctuation from names.
  const name = String(node.userData.name ?? node.name);
  if (name.includes(JAPANESE_EYES[side === 0 ? "left" : "right"])) return true;
  const words = splitWords(name);
  const whole = words.join("");
  const sideWords = SIDE_WORDS.map((pair) => pair[side]);
  if (sideWords.some((word) => EYE_WORDS.some((eye) => whole === word + eye || whole === eye + word))) return true;
  return (
    words.some((word) => EYE_WORDS.includes(word)) &&
    words.some((word) => sideWords.includes(word)) &&
    !words.some((word) => OTHER_WORDS.includes(word))
  );
}
