/** Small line or area plot of one quantity over the last minute. */
import { translate } from "../../i18n/translator";
import { element, setAttribute, setText, shape } from "../dom";
import type { SampleHistory } from "./sample-history";

export const PLOT_WIDTH = 100;
export const PLOT_HEIGHT = 34;

/** Return the upper end of a scale: the maximum rounded up to 1, 2 or 5 times a power of ten, at least `minTop`. */
export function niceScaleMax(values: readonly number[], minTop: number): number {
  const max = values.reduce((high, value) => (value > high ? value : high), minTop);
  const power = 10 ** Math.floor(Math.log10(max));
  return [1, 2, 5, 10].map((step) => step * power).find((top) => top >= max * 0.999) ?? 10 * power;
}

/** Return the SVG path of the samples, the last at the right edge of `slots` positions. Gaps stay open. */
export function tracePath(values: readonly number[], slots: number, top: number): string {
  let path = "";
  let drawing = false;
  values.forEach((value, i) => {
    if (!Number.isFinite(value)) {
      drawing = false;
      return;
    }
    const x = ((slots - values.length + i) / (slots - 1)) * PLOT_WIDTH;
    const y = PLOT_HEIGHT - Math.min(1, Math.max(0, value / top)) * (PLOT_HEIGHT - 2);
    path += `${drawing ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`;
    drawing = true;
  });
  return path;
}

/** Return the path of `tracePath` with each unbroken run closed along the base line. */
export function areaPath(values: readonly number[], slots: number, top: number): string {
  return tracePath(values, slots, top)
    .split("M")
    .filter((run) => run.length > 0)
    .map((run) => {
      const points = run.split("L");
      const [first, last] = [points[0].split(" ")[0], points[points.length - 1].split(" ")[0]];
      return `M${run}L${last} ${PLOT_HEIGHT}L${first} ${PLOT_HEIGHT}Z`;
    })
    .join("");
}

export interface PlotOptions {
  label: string;
  /** CSS colour. */
  color: string;
  /** Smallest upper end of the scale. */
  minTop: number;
  filled?: boolean;
}

export interface Plot {
  readonly element: HTMLElement;
  render(history: SampleHistory, slots: number, value: string, note: string, goal?: number): void;
}

export function createPlot({ label, color, minTop, filled = false }: PlotOptions): Plot {
  const value = element("div", { class: "plot-value" });
  const note = element("div", { class: "plot-note" });
  const goalLine = shape("path", { class: "goal" });
  const trace = shape("path", { class: filled ? "area" : "trace" });
  const svg = shape("svg", {
    viewBox: `0 0 ${PLOT_WIDTH} ${PLOT_HEIGHT}`,
    preserveAspectRatio: "none",
    role: "img",
    "aria-label": translate("{label}, no data yet", { label }),
  });
  svg.append(goalLine, trace, shape("path", { class: "base", d: `M0 ${PLOT_HEIGHT + 0.5}H${PLOT_WIDTH}` }));
  const plot = element(
    "div",
    { class: "plot", style: `--ink: ${color}` },
    element("div", { class: "plot-label" }, label),
    value,
  );
  plot.append(svg, note);
  return {
    element: plot,
    render(history, slots, valueText, noteText, goal) {
      setText(value, valueText);
      setText(note, noteText);
      const top = niceScaleMax(history.values.filter(Number.isFinite), Math.max(minTop, goal ?? 0));
      trace.setAttribute("d", (filled ? areaPath : tracePath)(history.values, slots, top));
      setAttribute(
        goalLine,
        "d",
        goal === undefined
          ? null
          : tracePath(
              Array.from({ length: slots }, () => goal),
              slots,
              top,
            ),
      );
      svg.setAttribute(
        "aria-label",
        translate("{label} over the last minute, now {value}, scale to {top}", { label, value: valueText, top }),
      );
    },
  };
}
