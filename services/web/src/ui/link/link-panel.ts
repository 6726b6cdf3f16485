/** Connection panel: bitrate, buffer, clock error and latency over the last minute, and the reason for the bitrate. */
import { formatDecimal } from "../../i18n/number-format";
import { translate } from "../../i18n/translator";
import { element, setText } from "../dom";
import { formatFigure } from "../format";
import type { ViewerStatistics } from "../limb-state";
import { createPanel, type Panel } from "../panel";
import type { LinkHealth } from "../transport/transport";
import { createPlot, SampleHistory } from "./plot";

/** Samples of one minute, two per second. */
const HISTORY_SAMPLES = 120;
/** Buffer that the server aims for. */
const BUFFER_TARGET_S = 4;

export interface LinkPanel {
  readonly panel: Panel;
  /** Add a sample. Call this twice a second, also while the panel is hidden. */
  addSample(statistics: ViewerStatistics, levelCount: number): void;
  assessHealth(statistics: ViewerStatistics, connected: boolean): LinkHealth;
}

export function createLinkPanel(root: HTMLElement, close: () => void): LinkPanel {
  const panel = createPanel(root, "line-card", translate("Connection"), close);
  const level = element("b");
  const reason = element("span");
  const plots = {
    bitrate: createPlot({ label: translate("Bitrate"), color: "var(--gold)", minTop: 5, filled: true }),
    buffer: createPlot({ label: translate("Buffer"), color: "var(--gold)", minTop: 5 }),
    clock: createPlot({ label: translate("Clock error"), color: "var(--holder-3)", minTop: 2 }),
    latency: createPlot({ label: translate("Latency"), color: "var(--holder-2)", minTop: 50 }),
  };
  const histories = {
    bitrate: new SampleHistory(HISTORY_SAMPLES),
    buffer: new SampleHistory(HISTORY_SAMPLES),
    clock: new SampleHistory(HISTORY_SAMPLES),
    latency: new SampleHistory(HISTORY_SAMPLES),
  };
  panel.body.append(
    element("p", { class: "why" }, level, reason),
    element("div", { class: "plots" }, ...Object.values(plots).map((plot) => plot.element)),
  );
  const milliseconds = (value: number | null) =>
    value === null ? "-" : `${formatDecimal(value, Math.abs(value) < 10 ? 1 : 0)} ms`;
  return {
    panel,
    addSample(statistics, levelCount) {
      const { kbps, bufferSeconds, clockErrorMs, clockOffsetMs, latencyMs, firstPoseMs, gaps } = statistics;
      histories.bitrate.push(kbps);
      histories.buffer.push(bufferSeconds);
      histories.clock.push(clockErrorMs ?? Number.NaN);
      histories.latency.push(latencyMs ?? Number.NaN);
      if (panel.element.hidden) return;
      setText(
        level,
        statistics.rate < 0
          ? translate("No dance yet")
          : translate("Level {level} of {levels}", { level: statistics.rate + 1, levels: levelCount }),
      );
      setText(reason, statistics.reason ? translate(", {reason}", { reason: statistics.reason }) : "");
      plots.bitrate.render(
        histories.bitrate,
        HISTORY_SAMPLES,
        `${formatFigure(kbps)} kbit/s`,
        gaps > 1
          ? translate("{count} gaps", { count: formatDecimal(gaps, 0) })
          : translate(gaps === 1 ? "1 gap" : "no gaps"),
      );
      plots.buffer.render(
        histories.buffer,
        HISTORY_SAMPLES,
        translate("{seconds} s", { seconds: formatDecimal(bufferSeconds, 1) }),
        translate("target {seconds} s", { seconds: BUFFER_TARGET_S }),
        BUFFER_TARGET_S,
      );
      const offset =
        clockOffsetMs !== null
          ? translate("offset {time}", { time: milliseconds(clockOffsetMs) })
          : translate("measuring");
      plots.clock.render(
        histories.clock,
        HISTORY_SAMPLES,
        clockErrorMs !== null ? `±${milliseconds(clockErrorMs)}` : "-",
        offset,
      );
      plots.latency.render(
        histories.latency,
        HISTORY_SAMPLES,
        milliseconds(latencyMs),
        translate("first pose {time}", { time: milliseconds(firstPoseMs) }),
      );
    },
    assessHealth({ bufferSeconds }, connected) {
      if (!connected) return "lost";
      return bufferSeconds < 0.5 ? "poor" : "good";
    },
  };
}
