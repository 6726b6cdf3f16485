/** Scripts that run in pages and workers before their own. Each function is copied there, so it uses only globals. */
import { slowDownDisplay } from "../browser/slow-display";

/** What the probe of a page has recorded, as `window.probe`. */
export interface PageProbe {
  /** Errors of the page and its workers. */
  readonly errors: string[];
  /** Messages of the page and its elements, in order: toasts and notices disappear again. */
  readonly announcements: string[];
  /** Last place of the invitation to take a hand, which is shown for some seconds; null before. */
  invitation: { left: number; right: number; top: number; bottom: number } | null;
  /** Return the highest amplitude that plays now, 0 to 1. */
  getSoundLevel(): number;
}

declare global {
  interface Window {
    probe: PageProbe;
  }
}

/** Interval between frames, in milliseconds: the browsers render in software. */
const FRAME_INTERVAL_MS = 250;

/** In the page: collect its errors. */
function recordErrors(): void {
  const errors: string[] = [];
  Object.assign(window, { probe: { errors } });
  addEventListener(
    "error",
    (event) => {
      const { message, target } = event;
      // An element announces its errors by events of its own.
      if (event instanceof CustomEvent) return;
      // A hint that was of no use is no error.
      if (target instanceof HTMLLinkElement && /^(modulepreload|prefetch)$/.test(target.rel)) return;
      errors.push(message ?? `not loaded: ${(target as Element | null)?.outerHTML}`);
    },
    true,
  );
  addEventListener("unhandledrejection", ({ reason }) => errors.push(`unhandled: ${reason}`));
  addEventListener("securitypolicyviolation", ({ violatedDirective, blockedURI }) =>
    errors.push(`blocked by ${violatedDirective}: ${blockedURI}`),
  );
  const write = console.error;
  console.error = (...values: unknown[]) => {
    errors.push(values.map(String).join(" "));
    write.apply(console, values);
  };
}

/** In the page: record its messages and invitation, which may have disappeared when the test looks. */
function recordMessages(): void {
  const announcements: string[] = [];
  Object.assign(window.probe, { announcements, invitation: null });
  const observer = new MutationObserver((mutations) => {
    for (const { target, addedNodes } of mutations) {
      if (!(target instanceof HTMLElement)) continue;
      if (target.matches(".invitation") && !target.hidden) {
        const { left, right, top, bottom } = target.getBoundingClientRect();
        window.probe.invitation = { left, right, top, bottom };
      }
      if (!target.closest("[role=status], [role=alert]")) continue;
      for (const { textContent } of addedNodes) if (textContent) announcements.push(textContent);
    }
  });
  const observe = (root: Node) =>
    observer.observe(root, { subtree: true, childList: true, attributeFilter: ["hidden", "style"] });
  observe(document);
  const attach = Element.prototype.attachShadow;
  Element.prototype.attachShadow = function (options) {
    const root = attach.call(this, options);
    observe(root);
    return root;
  };
}

/** In the page: measure the sound that reaches the audio device. */
function measureSound(): void {
  const meters: AnalyserNode[] = [];
  window.probe.getSoundLevel = () => {
    let level = 0;
    for (const meter of meters) {
      const samples = new Float32Array(meter.fftSize);
      meter.getFloatTimeDomainData(samples);
      for (const sample of samples) level = Math.max(level, Math.abs(sample));
    }
    return level;
  };
  const connect = AudioNode.prototype.connect as (this: AudioNode, to: AudioNode, ...rest: number[]) => AudioNode;
  AudioNode.prototype.connect = function (this: AudioNode, to: AudioNode, ...rest: number[]) {
    if (!(to instanceof AudioDestinationNode)) return connect.call(this, to, ...rest);
    const meter = new AnalyserNode(this.context);
    meters.push(meter);
    connect.call(this, meter, ...rest);
    return connect.call(meter, to);
  } as typeof AudioNode.prototype.connect;
}

/**
 * In a page or worker: report the software driver that draws. WebKit reports "Apple GPU" for every driver, and the page
 * then draws in the quality for graphics processors, which takes seconds per frame in software.
 */
function reportSoftwareDriver(): void {
  const { WebGL2RenderingContext } = globalThis as Partial<typeof globalThis>;
  if (!WebGL2RenderingContext) return;
  const UNMASKED_RENDERER_WEBGL = 0x9246;
  const { prototype } = WebGL2RenderingContext;
  const getParameter = prototype.getParameter as (this: WebGL2RenderingContext, name: number) => unknown;
  prototype.getParameter = function (name) {
    return name === UNMASKED_RENDERER_WEBGL ? "llvmpipe" : getParameter.call(this, name);
  };
}

const SLOW_DISPLAY = `(${slowDownDisplay})(${FRAME_INTERVAL_MS});`;

/** Return the scripts of pages and workers. `removeFeatures` runs in both before everything else. */
export function createProbes(removeFeatures: () => void): { page: string; worker: string } {
  const everywhere = `(${removeFeatures})(); (${reportSoftwareDriver})(); ${SLOW_DISPLAY}`;
  return {
    page: `${[recordErrors, recordMessages, measureSound].map((probe) => `(${probe})();`).join("\n")}
${everywhere}`,
    // Errors of a worker are reported by its page.
    worker: everywhere,
  };
}
