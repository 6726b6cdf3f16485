/**
 * Content of the connection panel: bitrate, buffer, clock error and latency over the last minute, the reason for the
 * bitrate, and the latency of live performers.
 */
import { formatDecimal } from "../../i18n/number-format";
import { translate } from "../../i18n/translator";
import { element, setText } from "../dom";
import { formatFigure } from "../format";
import type { ViewerStatistics } from "../limb-state";
import { createPlot } from "./plot";
import type { SampleHistory } from "./sample-history";

/** Buffer that the server aims for. */
const BUFFER_TARGET_S = 4;

export type LinkHistories = Readonly<Record<"bitrate" | "buffer" | "clock" | "latency", SampleHistory>>;

export interface LinkFigures {
  /** Show the last sample and the histories. */
  render(statistics: ViewerStatistics, levelCount: number): void;
}

/** Append the content to `root`. The plots have `slots` positions. */
export function createLinkFigures(root: HTMLElement, histories: LinkHistories, slots: number): LinkFigures {
  const level = element("b");
  const reason = element("span");
  const plots = {
    bitrate: createPlot({ label: translate("Bitrate"), color: "var(--gold)", minTop: 5, filled: true }),
    buffer: createPlot({ label: translate("Buffer"), color: "var(--gold)", minTop: 5 }),
    clock: createPlot({ label: translate("Clock error"), color: "var(--holder-3)", minTop: 2 }),
    latency: createPlot({ label: translate("Latency"), color: "var(--holder-2)", minTop: 50 }),
  };
  const live = element("p", { class: "why", hidden: true });
  root.append(
    element("p", { class: "why" }, level, reason),
    live,
    element("div", { class: "plots" }, ...Object.values(plots).map((plot) => plot.element)),
  );
  const milliseconds = (value: number | null) =>
    value === null ? "-" : `${formatDecimal(value, Math.abs(value) < 10 ? 1 : 0)} ms`;
  return {
    render(statistics, levelCount) {
      const { kbps, bufferSeconds, clockErrorMs, clockOffsetMs, latencyMs, firstPoseMs, gaps, liveLatencyMs } =
        statistics;
      setText(
        level,
        statistics.rate < 0
          ? translate("No dance yet")
          : translate("Level {level} of {levels}", { level: statistics.rate + 1, levels: levelCount }),
      );
      setText(reason, statistics.reason ? translate(", {reason}", { reason: statistics.reason }) : "");
      live.hidden = liveLatencyMs === null;
      setText(live, translate("Live: {time} after the movement", { time: milliseconds(liveLatencyMs) }));
      plots.bitrate.render(
        histories.bitrate,
        slots,
        `${formatFigure(kbps)} kbit/s`,
        gaps > 1
          ? translate("{count} gaps", { count: formatDecimal(gaps, 0) })
          : translate(gaps === 1 ? "1 gap" : "no gaps"),
      );
      plots.buffer.render(
        histories.buffer,
        slots,
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
        slots,
        clockErrorMs !== null ? `±${milliseconds(clockErrorMs)}` : "-",
        offset,
      );
      plots.latency.render(
        histories.latency,
        slots,
        milliseconds(latencyMs),
        translate("first pose {time}", { time: milliseconds(firstPoseMs) }),
      );
    },
  };
}
