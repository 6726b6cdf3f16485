/** The line in figures: rate, buffer, clock and latency over the last minute, and why the rate is what it is. */

import { formatDecimal } from "../../i18n/number-format";
import { translate } from "../../i18n/translator";
import { element, setText } from "../dom";
import { formatFigure } from "../format";
import type { ViewerStatistics } from "../limb-state";
import { createPanel, type Panel } from "../panel";
import type { LinkHealth } from "../transport/transport";
import { createPlot, SampleHistory } from "./plot";

/** Two samples a second for a minute. */
const HISTORY_SAMPLES = 120;
/** The buffer the server tries to keep, seconds. */
const BUFFER_TARGET_S = 4;

export interface LinkPanel {
  readonly panel: Panel;
  /** Adds a sample; call it twice a second, shown or not. */
  addSample(statistics: ViewerStatistics, levelCount: number): void;
  assessHealth(statistics: ViewerStatistics, connected: boolean): LinkHealth;
}

export function createLinkPanel(root: HTMLElement, close: () => void): LinkPanel {
  const panel = createPanel(root, "line-card", translate("Line"), close);
  const chosen = element("b");
  const reason = element("span");
  const plots = {
    rate: createPlot({ label: translate("Rate"), color: "var(--gold)", minTop: 5, filled: true }),
    buffer: createPlot({ label: translate("Buffer"), color: "var(--gold)", minTop: 5 }),
    clock: createPlot({ label: translate("Clock error"), color: "var(--holder-3)", minTop: 2 }),
    latency: createPlot({ label: translate("Latency"), color: "var(--holder-2)", minTop: 50 }),
  };
  const histories = {
    rate: new SampleHistory(HISTORY_SAMPLES),
    buffer: new SampleHistory(HISTORY_SAMPLES),
    clock: new SampleHistory(HISTORY_SAMPLES),
    latency: new SampleHistory(HISTORY_SAMPLES),
  };
  panel.body.append(
    element("p", { class: "why" }, chosen, reason),
    element("div", { class: "plots" }, ...Object.values(plots).map((plot) => plot.element)),
  );
  const milliseconds = (value: number | null) =>
    value === null ? "-" : `${formatDecimal(value, Math.abs(value) < 10 ? 1 : 0)} ms`;
  return {
    panel,
    addSample(line, rates) {
      histories.rate.push(line.kbps);
      histories.buffer.push(line.bufferSeconds);
      histories.clock.push(line.clockErrorMs ?? Number.NaN);
      histories.latency.push(line.latencyMs ?? Number.NaN);
      if (panel.element.hidden) return;
      setText(
        chosen,
        line.rate < 0 ? translate("No dance yet") : translate("Rate {rate} of {rates}", { rate: line.rate + 1, rates }),
      );
      setText(reason, line.reason ? translate(", {reason}", { reason: line.reason }) : "");
      plots.rate.render(
        histories.rate,
        HISTORY_SAMPLES,
        `${formatFigure(line.kbps)} kbit/s`,
        line.gaps > 1
          ? translate("{count} gaps", { count: formatDecimal(line.gaps, 0) })
          : translate(line.gaps === 1 ? "1 gap" : "no gaps"),
      );
      plots.buffer.render(
        histories.buffer,
        HISTORY_SAMPLES,
        translate("{seconds} s", { seconds: formatDecimal(line.bufferSeconds, 1) }),
        translate("goal {seconds} s", { seconds: BUFFER_TARGET_S }),
        BUFFER_TARGET_S,
      );
      const offset =
        line.clockOffsetMs !== null
          ? translate("offset {time}", { time: milliseconds(line.clockOffsetMs) })
          : translate("measuring");
      plots.clock.render(
        histories.clock,
        HISTORY_SAMPLES,
        line.clockErrorMs !== null ? `±${milliseconds(line.clockErrorMs)}` : "-",
        offset,
      );
      plots.latency.render(
        histories.latency,
        HISTORY_SAMPLES,
        milliseconds(line.latencyMs),
        translate("first pose {time}", { time: milliseconds(line.firstPoseMs) }),
      );
    },
    assessHealth(line, connected) {
      if (!connected) return "lost";
      return line.bufferSeconds < 0.5 ? "poor" : "good";
    },
  };
}
