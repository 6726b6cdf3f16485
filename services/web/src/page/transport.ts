/** Play, seek, loop, and the three panels' buttons. */
import { element, setAttribute, setText } from "./dom";
import { clockTime } from "./format";
import { icon, type IconName } from "./icons";
import { createSeek } from "./seek";

export type PanelName = "library" | "strings" | "line";
export type Health = "good" | "poor" | "lost" | "none";

export interface Transport {
  timeline(playing: boolean, loop: boolean, ready: boolean): void;
  position(seconds: number, duration: number): void;
  blocks(blocks: ArrayLike<number>, rates: number): void;
  expanded(panel: PanelName, open: boolean): void;
  health(health: Health): void;
}

const PANELS: readonly { name: PanelName; label: string; icon: IconName }[] = [
  { name: "library", label: "Library", icon: "library" },
  { name: "strings", label: "Strings", icon: "strings" },
  { name: "line", label: "Line", icon: "line" },
];
const HEALTH: Readonly<Record<Health, string>> = { good: "good", poor: "short of data", lost: "not connected", none: "no dance yet" };

export function createTransport(root: HTMLElement, on: { play(): void; loop(): void; seek(seconds: number): void; panel(panel: PanelName): void }): Transport {
  const play = element("button", { class: "play", type: "button", disabled: true, onClick: on.play }, icon("play"));
  const [now, end] = [element("span"), element("span")];
  const seek = createSeek(on.seek);
  const loop = element("button", { class: "round-button loop", type: "button", "aria-label": "Loop", onClick: on.loop }, icon("loop"));
  const dot = element("span", { class: "health", role: "img" });
  const pills = new Map(
    PANELS.map(({ name, label, icon: glyph }) => {
      const pill = element("button", { class: "pill", type: "button", "data-panel": name, "aria-label": label, "aria-expanded": "false", onClick: () => on.panel(name) });
      pill.append(icon(glyph), element("span", {}, label));
      if (name === "line") pill.append(dot);
      return [name, pill] as const;
    }),
  );
  const tools = element("div", { class: "tools" }, loop, element("span", { class: "tools-rule" }), ...pills.values());
  const area = element("div", { class: "seek-area" }, element("div", { class: "times" }, now, end), seek.element);
  root.append(element("section", { class: "transport", "aria-label": "Transport" }, play, area, tools));
  let shown = "";
  return {
    timeline(playing, looping, ready) {
      play.disabled = !ready;
      const state = playing ? "Pause" : "Play";
      setAttribute(loop, "aria-pressed", String(looping));
      if (shown === state) return;
      shown = state;
      play.setAttribute("aria-label", state);
      play.replaceChildren(icon(playing ? "pause" : "play"));
    },
    position(seconds, duration) {
      setText(now, clockTime(seconds));
      setText(end, clockTime(duration));
      seek.position(seconds, duration);
    },
    blocks: seek.blocks,
    expanded(panel, open) {
      pills.get(panel)?.setAttribute("aria-expanded", String(open));
    },
    health(health) {
      dot.dataset.state = health;
      dot.setAttribute("aria-label", HEALTH[health]);
    },
  };
}
