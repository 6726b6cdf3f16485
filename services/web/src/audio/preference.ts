/** Whether the sound is wanted, and how loud; remembered. */
import { browserStore } from "../storage/store";

const KEY = "bunraku.sound";

export interface SoundPreference {
  readonly on: boolean;
  /** 0 to 1, as it is heard. */
  readonly volume: number;
}

/** Where it is kept whether sound is wanted. */
export interface SoundMemory {
  load(): SoundPreference;
  save(preference: SoundPreference): void;
}

const DEFAULT: SoundPreference = { on: true, volume: 0.8 };

/** The page's: kept until the person clears it. */
export const browserSound: SoundMemory = {
  load() {
    const { on, volume } = (browserStore.getJson(KEY) ?? {}) as Partial<Record<keyof SoundPreference, unknown>>;
    const good = typeof volume === "number" && volume >= 0 && volume <= 1;
    return { on: typeof on === "boolean" ? on : DEFAULT.on, volume: good ? volume : DEFAULT.volume };
  },
  save(preference) {
    browserStore.putJson(KEY, preference);
  },
};
