/**
 * Connection panel. Its content is loaded when it is first opened; the samples that it shows are stored from the start.
 */
import { translate } from "../../i18n/translator";
import type { ViewerStatistics } from "../limb-state";
import { createPanel, type Panel } from "../panel";
import type { LinkHealth } from "../transport/transport";
import type { LinkFigures, LinkHistories } from "./link-figures";
import { SampleHistory } from "./sample-history";

/** Samples of one minute, two per second. */
const HISTORY_SAMPLES = 120;

export interface LinkPanel {
  readonly panel: Panel;
  /** Load the content, unless it was loaded before. Call this when the panel opens. */
  load(): void;
  /** Add a sample. Call this twice a second, also while the panel is hidden. */
  addSample(statistics: ViewerStatistics, levelCount: number): void;
  assessHealth(statistics: ViewerStatistics, connected: boolean): LinkHealth;
}

/** Create the panel. `onLoadError` is called if its content cannot be loaded. */
export function createLinkPanel(root: HTMLElement, close: () => void, onLoadError: () => void): LinkPanel {
  const panel = createPanel(root, "line-card", translate("Connection"), close);
  const histories: LinkHistories = {
    bitrate: new SampleHistory(HISTORY_SAMPLES),
    buffer: new SampleHistory(HISTORY_SAMPLES),
    clock: new SampleHistory(HISTORY_SAMPLES),
    latency: new SampleHistory(HISTORY_SAMPLES),
  };
  let figures: LinkFigures | null = null;
  let isRequested = false;
  let last: Parameters<LinkFigures["render"]> | null = null;
  const render = () => {
    if (last && !panel.element.hidden) figures?.render(...last);
  };
  const load = async () => {
    const { createLinkFigures } = await import("./link-figures");
    figures = createLinkFigures(panel.body, histories, HISTORY_SAMPLES);
    render();
  };
  return {
    panel,
    load() {
      if (isRequested) return;
      isRequested = true;
      load().catch(() => {
        isRequested = false;
        onLoadError();
      });
    },
    addSample(statistics, levelCount) {
      const { kbps, bufferSeconds, clockErrorMs, latencyMs } = statistics;
      histories.bitrate.push(kbps);
      histories.buffer.push(bufferSeconds);
      histories.clock.push(clockErrorMs ?? Number.NaN);
      histories.latency.push(latencyMs ?? Number.NaN);
      last = [statistics, levelCount];
      render();
    },
    assessHealth({ bufferSeconds }, connected) {
      if (!connected) return "lost";
      return bufferSeconds < 0.5 ? "poor" : "good";
    },
  };
}
