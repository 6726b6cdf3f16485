/** Colour theme, night or day: the system's preference until the user toggles it. The choice is stored. */
import type { Theme } from "../stage/scenery/look";
import { browserStorage } from "../storage/web-storage";

const STORAGE_KEY = "bunraku.theme";
const LIGHT_SCHEME = "(prefers-color-scheme: light)";

export interface ThemeChoice {
  readonly theme: Theme;
  toggle(): void;
}

/** Apply the current theme to the document, and return it. */
export function applyTheme(theme = storedTheme() ?? systemTheme()): Theme {
  document.documentElement.dataset.theme = theme;
  return theme;
}

/** Apply the theme to the document, now and whenever it changes. `onChange` is called each time, also at once. */
export function createTheme(onChange: (theme: Theme) => void): ThemeChoice {
  const system = matchMedia(LIGHT_SCHEME);
  let chosen = storedTheme();
  const current = (): Theme => chosen ?? (system.matches ? "day" : "night");
  const apply = () => onChange(applyTheme(current()));
  system.addEventListener("change", apply);
  apply();
  return {
    get theme() {
      return current();
    },
    toggle() {
      chosen = current() === "night" ? "day" : "night";
      browserStorage.put(STORAGE_KEY, chosen);
      apply();
    },
  };
}

function systemTheme(): Theme {
  return matchMedia(LIGHT_SCHEME).matches ? "day" : "night";
}

function storedTheme(): Theme | null {
  const value = browserStorage.get(STORAGE_KEY);
  return value === "night" || value === "day" ? value : null;
}
