/**
 * Rules between ARKit's blend shapes and VRM's presets, for faces whose expressions an avatar does not have: one shows
 * parts of a face, the other whole expressions.
 */

/** Weight of an expression by name. */
export type WeightOf = (name: string) => number;

/** A preset that follows from the weights of other expressions. */
export interface PresetRule {
  readonly preset: string;
  /** Expressions that it follows from. */
  readonly inputs: readonly string[];
  /** Expressions that show the same on an avatar that has them; the preset is then left out. */
  readonly witnesses: readonly string[];
  weigh(weight: WeightOf): number;
}

/** Mouth shapes of speech, whose weights are at most 1 in sum. */
export const MOUTH_PRESETS: readonly string[] = ["aa", "ih", "ou", "ee", "oh"];
/** Emotions; of those that follow from other expressions, the weights are at most 1 in sum. */
export const EMOTION_PRESETS: readonly string[] = ["happy", "angry", "sad", "relaxed", "surprised"];

const bothSides = (name: string) => [`${name}Left`, `${name}Right`];
const mean = (weight: WeightOf, name: string) => (weight(`${name}Left`) + weight(`${name}Right`)) / 2;
const opening = (weight: WeightOf) => Math.max(0, weight("jawOpen") - weight("mouthClose"));
const rounding = (weight: WeightOf) => Math.max(weight("mouthFunnel"), weight("mouthPucker"));
const eyelid = (weight: WeightOf, side: string) => Math.max(weight(`eyeBlink${side}`), weight(`blink${side}`));

const MOUTH_INPUTS = [
  "jawOpen",
  "mouthClose",
  "mouthFunnel",
  "mouthPucker",
  ...["mouthStretch", "mouthUpperUp", "mouthLowerDown"].flatMap(bothSides),
];
const SMILE_WITNESSES = bothSides("mouthSmile");

export const PRESET_RULES: readonly PresetRule[] = [
  {
    preset: "blinkLeft",
    inputs: ["eyeBlinkLeft"],
    witnesses: ["eyeBlinkLeft"],
    weigh: (weight) => weight("eyeBlinkLeft"),
  },
  {
    preset: "blinkRight",
    inputs: ["eyeBlinkRight"],
    witnesses: ["eyeBlinkRight"],
    weigh: (weight) => weight("eyeBlinkRight"),
  },
  {
    // An avatar that cannot wink does not close both eyes instead.
    preset: "blink",
    inputs: [...bothSides("eyeBlink"), ...bothSides("blink")],
    witnesses: [...bothSides("eyeBlink"), ...bothSides("blink")],
    weigh: (weight) => Math.min(eyelid(weight, "Left"), eyelid(weight, "Right")),
  },
  {
    preset: "aa",
    inputs: MOUTH_INPUTS,
    witnesses: ["jawOpen"],
    weigh: (weight) => opening(weight) * (1 - rounding(weight)),
  },
  {
    preset: "oh",
    inputs: MOUTH_INPUTS,
    witnesses: ["mouthFunnel"],
    weigh: (weight) => weight("mouthFunnel") * (0.4 + 0.6 * opening(weight)),
  },
  {
    preset: "ou",
    inputs: MOUTH_INPUTS,
    witnesses: ["mouthPucker"],
    weigh: (weight) => weight("mouthPucker") * (1 - weight("mouthFunnel")),
  },
  {
    preset: "ee",
    inputs: MOUTH_INPUTS,
    witnesses: bothSides("mouthStretch"),
    weigh: (weight) => mean(weight, "mouthStretch") * (1 - rounding(weight)),
  },
  {
    preset: "ih",
    inputs: MOUTH_INPUTS,
    witnesses: bothSides("mouthUpperUp"),
    weigh: (weight) => 0.5 * (mean(weight, "mouthUpperUp") + mean(weight, "mouthLowerDown")) * (1 - opening(weight)),
  },
  {
    // A broad smile is happy, a slight one relaxed.
    preset: "happy",
    inputs: bothSides("mouthSmile"),
    witnesses: SMILE_WITNESSES,
    weigh: (weight) => mean(weight, "mouthSmile") ** 2,
  },
  {
    preset: "relaxed",
    inputs: bothSides("mouthSmile"),
    witnesses: SMILE_WITNESSES,
    weigh: (weight) => mean(weight, "mouthSmile") * (1 - mean(weight, "mouthSmile")),
  },
  {
    preset: "angry",
    inputs: bothSides("browDown"),
    witnesses: bothSides("browDown"),
    weigh: (weight) =>
      mean(weight, "browDown") *
      (0.6 + 0.4 * Math.max(mean(weight, "noseSneer"), mean(weight, "mouthPress"))) *
      (1 - mean(weight, "mouthSmile")),
  },
  {
    preset: "sad",
    inputs: ["browInnerUp", ...bothSides("mouthFrown")],
    witnesses: bothSides("mouthFrown"),
    weigh: (weight) =>
      Math.max(mean(weight, "mouthFrown"), 0.6 * weight("browInnerUp") * (1 - mean(weight, "browOuterUp"))) *
      (1 - mean(weight, "mouthSmile")) *
      (1 - mean(weight, "browDown")),
  },
  {
    preset: "surprised",
    inputs: ["browInnerUp", ...bothSides("eyeWide"), ...bothSides("browOuterUp")],
    witnesses: bothSides("eyeWide"),
    weigh: (weight) =>
      ((mean(weight, "eyeWide") + weight("browInnerUp") + mean(weight, "browOuterUp")) / 3) *
      (1 - mean(weight, "browDown")),
  },
];

/** Blend shapes that show a preset, with their weights at its full weight. */
export const PRESET_SHAPES: Readonly<Record<string, Readonly<Record<string, number>>>> = {
  blinkLeft: { eyeBlinkLeft: 1 },
  blinkRight: { eyeBlinkRight: 1 },
  blink: { blinkLeft: 1, blinkRight: 1, eyeBlinkLeft: 1, eyeBlinkRight: 1 },
  aa: { jawOpen: 0.7, ...onBothSides({ mouthLowerDown: 0.2 }) },
  ih: { jawOpen: 0.15, ...onBothSides({ mouthStretch: 0.3, mouthUpperUp: 0.2, mouthLowerDown: 0.3 }) },
  ou: { jawOpen: 0.1, mouthPucker: 0.8 },
  ee: { jawOpen: 0.2, ...onBothSides({ mouthStretch: 0.6, mouthLowerDown: 0.2 }) },
  oh: { jawOpen: 0.4, mouthFunnel: 0.7 },
  happy: onBothSides({ mouthSmile: 0.8, cheekSquint: 0.5, eyeSquint: 0.3 }),
  angry: onBothSides({ browDown: 0.9, noseSneer: 0.4, mouthPress: 0.3 }),
  sad: { browInnerUp: 0.8, ...onBothSides({ mouthFrown: 0.7 }) },
  relaxed: onBothSides({ mouthSmile: 0.3, eyeSquint: 0.2 }),
  surprised: { jawOpen: 0.3, browInnerUp: 0.6, ...onBothSides({ eyeWide: 0.7, browOuterUp: 0.7 }) },
};

function onBothSides(weights: Readonly<Record<string, number>>): Record<string, number> {
  return Object.fromEntries(
    Object.entries(weights).flatMap(([name, weight]) => bothSides(name).map((sided) => [sided, weight])),
  );
}
