/** Whether the sound is wanted, and how loud; remembered. */

const KEY = "bunraku.sound";

export interface SoundPreference {
  readonly on: boolean;
  /** 0 to 1, as it is heard. */
  readonly volume: number;
}

const DEFAULT: SoundPreference = { on: true, volume: 0.8 };

export function loadPreference(): SoundPreference {
  try {
    const { on, volume } = JSON.parse(localStorage.getItem(KEY) ?? "{}") as Partial<SoundPreference>;
    const good = typeof volume === "number" && volume >= 0 && volume <= 1;
    return { on: typeof on === "boolean" ? on : DEFAULT.on, volume: good ? volume : DEFAULT.volume };
  } catch {
    return DEFAULT; // Storage may be forbidden or hold what is none.
  }
}

export function savePreference(preference: SoundPreference): void {
  try {
    localStorage.setItem(KEY, JSON.stringify(preference));
  } catch {
    // As above: the choice then lasts as long as the page.
  }
}
