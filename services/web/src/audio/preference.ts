/** The user's sound preference, on or off and volume, stored in the browser. */
import { browserStorage } from "../storage/web-storage";

const STORAGE_KEY = "bunraku.sound";

export interface SoundPreference {
  readonly on: boolean;
  /** Perceived volume, 0 to 1. */
  readonly volume: number;
}

/** Storage of the sound preference. */
export interface SoundPreferenceStore {
  load(): SoundPreference;
  save(preference: SoundPreference): void;
}

const DEFAULT_PREFERENCE: SoundPreference = { on: true, volume: 0.8 };

/** Storage of the page: kept until the user clears it. */
export const browserSoundPreference: SoundPreferenceStore = {
  load() {
    const { on, volume } = (browserStorage.getJson(STORAGE_KEY) ?? {}) as Partial<
      Record<keyof SoundPreference, unknown>
    >;
    const isValid = typeof volume === "number" && volume >= 0 && volume <= 1;
    return {
      on: typeof on === "boolean" ? on : DEFAULT_PREFERENCE.on,
      volume: isValid ? volume : DEFAULT_PREFERENCE.volume,
    };
  },
  save(preference) {
    browserStorage.putJson(STORAGE_KEY, preference);
  },
};
