/** Weights of an avatar's expressions from those of a performer's face, which may know others. */
import { expressionIndex } from "../../motion/face";
import { EMOTION_PRESETS, MOUTH_PRESETS, PRESET_RULES, PRESET_SHAPES, type PresetRule } from "./expression-rules";

/** Share of a mouth shape that an avatar lacks by which its mouth opens. */
const MISSING_MOUTH_SHARE = 0.5;

/** Expression of the performer, by its index, that shows in one of the avatar, with a factor. */
interface Term {
  readonly expression: number;
  readonly target: number;
  readonly factor: number;
}

/** Preset that follows from others, and the avatar's expression that shows it. */
interface DerivedPreset {
  readonly rule: PresetRule;
  readonly target: number;
  readonly factor: number;
}

export class ExpressionMapping {
  /** Indices of the avatar's expressions that it writes. */
  readonly written: readonly number[];
  readonly #terms: readonly Term[];
  readonly #derived: readonly DerivedPreset[];
  readonly #derivedWeights: Float64Array;
  readonly #mouth: readonly number[];

  /**
   * @param known expressions that the face knows
   * @param targets expressions that the avatar has, under the same names
   */
  constructor(known: readonly string[], targets: readonly string[]) {
    this.#terms = known.flatMap((name) => findTerms(name, known, targets));
    const covered = new Set(this.#terms.map(({ target }) => target));
    this.#derived = PRESET_RULES.flatMap((rule): DerivedPreset[] => {
      const { preset, inputs, witnesses } = rule;
      if (known.includes(preset) || !inputs.some((name) => known.includes(name))) return [];
      if (witnesses.some((name) => targets.includes(name))) return [];
      const { target, factor } = findPreset(preset, targets);
      return target < 0 || covered.has(target) ? [] : [{ rule, target, factor }];
    });
    this.#derivedWeights = new Float64Array(this.#derived.length);
    this.written = [...new Set([...this.#terms, ...this.#derived].map(({ target }) => target))];
    this.#mouth = this.written.filter((target) => MOUTH_PRESETS.includes(targets[target]));
  }

  /** Write the weights of the avatar's expressions, 0..1, for those of a face. */
  apply(weights: Float64Array, out: Float64Array): void {
    for (const target of this.written) out[target] = 0;
    for (const { expression, target, factor } of this.#terms) out[target] += factor * weights[expression];
    this.#addDerived(weights, out);
    for (const target of this.written) out[target] = Math.min(Math.max(out[target], 0), 1);
    let sum = 0;
    for (const target of this.#mouth) sum += out[target];
    if (sum > 1) for (const target of this.#mouth) out[target] /= sum;
  }

  #addDerived(weights: Float64Array, out: Float64Array): void {
    if (this.#derived.length === 0) return;
    const weightOf = (name: string) => weights[expressionIndex(name)];
    const derived = this.#derivedWeights;
    let emotion = 0;
    this.#derived.forEach(({ rule }, at) => {
      derived[at] = rule.weigh(weightOf);
      if (EMOTION_PRESETS.includes(rule.preset)) emotion += derived[at];
    });
    this.#derived.forEach(({ rule, target, factor }, at) => {
      const share = EMOTION_PRESETS.includes(rule.preset) && emotion > 1 ? 1 / emotion : 1;
      out[target] += share * factor * derived[at];
    });
  }
}

/** Return the avatar's expressions that show an expression of the face: the same one, or others in its place. */
function findTerms(name: string, known: readonly string[], targets: readonly string[]): Term[] {
  const expression = expressionIndex(name);
  const same = findPreset(name, targets);
  if (same.target >= 0) return [{ expression, ...same }];
  const shapes = Object.entries(PRESET_SHAPES[name] ?? {}).filter(
    ([shape]) => targets.includes(shape) && !known.includes(shape),
  );
  // An eye with a preset and a blend shape would close twice.
  const eyes = shapes.filter(([shape]) => shape.startsWith("blink"));
  return (eyes.length > 0 ? eyes : shapes).map(([shape, factor]) => ({
    expression,
    target: targets.indexOf(shape),
    factor,
  }));
}

/** Return the index of the expression that an avatar shows for one, or for a preset that it lacks; -1 for none. */
function findPreset(name: string, targets: readonly string[]): { target: number; factor: number } {
  const own = targets.indexOf(name);
  if (own >= 0) return { target: own, factor: 1 };
  if (name === "relaxed" && !targets.includes("mouthSmileLeft")) return { target: targets.indexOf("happy"), factor: 1 };
  if (MOUTH_PRESETS.includes(name) && !targets.includes("jawOpen"))
    return { target: targets.indexOf("aa"), factor: MISSING_MOUTH_SHARE };
  return { target: -1, factor: 0 };
}
