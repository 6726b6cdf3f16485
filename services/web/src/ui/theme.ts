/** Colour theme, night or day: the system's preference until the user toggles it. The choice is stored. */
import type { Theme } from "../stage/scenery/look";
import { browserStorage } from "../storage/web-storage";

const STORAGE_KEY = "bunraku.theme";

export interface ThemeChoice {
  readonly theme: Theme;
  toggle(): void;
}

/** Apply the theme to the document, now and whenever it changes. `onChange` is called each time, also at once. */
export function createTheme(onChange: (theme: Theme) => void): ThemeChoice {
  const system = matchMedia("(prefers-color-scheme: light)");
  let chosen = storedTheme();
  const current = (): Theme => chosen ?? (system.matches ? "day" : "night");
  const apply = () => {
    document.documentElement.dataset.theme = current();
    onChange(current());
  };
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

function storedTheme(): Theme | null {
  const value = browserStorage.get(STORAGE_KEY);
  return value === "night" || value === "day" ? value : null;
}
