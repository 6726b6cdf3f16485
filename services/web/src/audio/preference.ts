/** Whether the sound is wanted, and how loud; remembered. */
import { browserStorage } from "../storage/web-storage";

const STORAGE_KEY = "bunraku.sound";

export interface SoundPreference {
  readonly on: boolean;
  /** 0 to 1, as it is heard. */
  readonly volume: number;
}

/** Where it is kept whether sound is wanted. */
export interface SoundPreferenceStore {
  load(): SoundPreference;
  save(preference: SoundPreference): void;
}

const DEFAULT_PREFERENCE: SoundPreference = { on: true, volume: 0.8 };

/** The page's: kept until the person clears it. */
export const browserSoundPreference: SoundPreferenceStore = {
  load() {
    const { on, volume } = (browserStorage.getJson(STORAGE_KEY) ?? {}) as Partial<
      Record<keyof SoundPreference, unknown>
    >;
    const good = typeof volume === "number" && volume >= 0 && volume <= 1;
    return {
      on: typeof on === "boolean" ? on : DEFAULT_PREFERENCE.on,
      volume: good ? volume : DEFAULT_PREFERENCE.volume,
    };
  },
  save(preference) {
    browserStorage.putJson(STORAGE_KEY, preference);
  },
};
