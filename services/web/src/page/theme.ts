/** Night or day: the system's wish, until the toggle says otherwise; remembered. */
import type { Theme } from "../stage/look";
import { browserStore } from "../storage/store";

const KEY = "bunraku.theme";

export interface ThemeChoice {
  readonly theme: Theme;
  toggle(): void;
}

/** Applies the theme to the document, now and whenever it changes; `changed` is called each time, also at once. */
export function createTheme(changed: (theme: Theme) => void): ThemeChoice {
  const system = matchMedia("(prefers-color-scheme: light)");
  let chosen = stored();
  const current = (): Theme => chosen ?? (system.matches ? "day" : "night");
  const apply = () => {
    document.documentElement.dataset.theme = current();
    changed(current());
  };
  system.addEventListener("change", apply);
  apply();
  return {
    get theme() {
      return current();
    },
    toggle() {
      chosen = current() === "night" ? "day" : "night";
      browserStore.put(KEY, chosen);
      apply();
    },
  };
}

function stored(): Theme | null {
  const value = browserStore.get(KEY);
  return value === "night" || value === "day" ? value : null;
}
