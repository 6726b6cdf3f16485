/** The line in figures: rate, buffer, clock and latency over the last minute, and why the rate is what it is. */
import { element, setText } from "./dom";
import { figure } from "./format";
import type { LineFigures } from "./model";
import { createPanel, type Panel } from "./panels";
import { createPlot, History } from "./plot";
import type { Health } from "./transport";
import { decimal } from "../words/numbers";
import { say } from "../words/say";

/** Two samples a second for a minute. */
const SLOTS = 120;
/** The buffer the server tries to keep, seconds. */
const BUFFER_GOAL = 4;

export interface LineCard {
  readonly panel: Panel;
  /** Adds a sample; call it twice a second, shown or not. */
  sample(line: LineFigures, rates: number): void;
  health(line: LineFigures, connected: boolean): Health;
}

export function createLineCard(root: HTMLElement, close: () => void): LineCard {
  const panel = createPanel(root, "line-card", say("Line"), close);
  const chosen = element("b");
  const reason = element("span");
  const plots = {
    rate: createPlot({ label: say("Rate"), ink: "var(--gold)", least: 5, filled: true }),
    buffer: createPlot({ label: say("Buffer"), ink: "var(--gold)", least: 5 }),
    clock: createPlot({ label: say("Clock error"), ink: "var(--holder-3)", least: 2 }),
    latency: createPlot({ label: say("Latency"), ink: "var(--holder-2)", least: 50 }),
  };
  const histories = { rate: new History(SLOTS), buffer: new History(SLOTS), clock: new History(SLOTS), latency: new History(SLOTS) };
  panel.body.append(
    element("p", { class: "why" }, chosen, reason),
    element("div", { class: "plots" }, ...Object.values(plots).map((plot) => plot.element)),
  );
  const milliseconds = (value: number | null) => (value === null ? "-" : `${decimal(value, Math.abs(value) < 10 ? 1 : 0)} ms`);
  return {
    panel,
    sample(line, rates) {
      histories.rate.push(line.kbps);
      histories.buffer.push(line.bufferSeconds);
      histories.clock.push(line.clockErrorMs ?? Number.NaN);
      histories.latency.push(line.latencyMs ?? Number.NaN);
      if (panel.element.hidden) return;
      setText(chosen, line.rate < 0 ? say("No dance yet") : say("Rate {rate} of {rates}", { rate: line.rate + 1, rates }));
      setText(reason, line.reason ? say(", {reason}", { reason: line.reason }) : "");
      plots.rate.render(histories.rate, SLOTS, `${figure(line.kbps)} kbit/s`, line.gaps > 1 ? say("{count} gaps", { count: decimal(line.gaps, 0) }) : say(line.gaps === 1 ? "1 gap" : "no gaps"));
      plots.buffer.render(histories.buffer, SLOTS, say("{seconds} s", { seconds: decimal(line.bufferSeconds, 1) }), say("goal {seconds} s", { seconds: BUFFER_GOAL }), BUFFER_GOAL);
      const offset = line.clockOffsetMs !== null ? say("offset {time}", { time: milliseconds(line.clockOffsetMs) }) : say("measuring");
      plots.clock.render(histories.clock, SLOTS, line.clockErrorMs !== null ? `±${milliseconds(line.clockErrorMs)}` : "-", offset);
      plots.latency.render(histories.latency, SLOTS, milliseconds(line.latencyMs), say("first pose {time}", { time: milliseconds(line.firstPoseMs) }));
    },
    health(line, connected) {
      if (!connected) return "lost";
      return line.bufferSeconds < 0.5 ? "poor" : "good";
    },
  };
}
