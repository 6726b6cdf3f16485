/**
 * The stage before the page around it: the engine starts and enters the session with few scripts, while those of the
 * page are not loaded yet. The page takes over what happened until then.
 */
import { pageAccess } from "../client/access";
import { listSessions } from "../client/api";
import type { EngineEvent, EngineOptions, PlaybackRequest } from "../engine/message";
import type { PlaybackKind } from "../engine/playback";
import { resolveDisplayName } from "../ui/display-name";
import { applyTheme } from "../ui/theme";
import { EngineConnection } from "./engine-connection";
import type { StartupSequence } from "./startup";
import { describeViewport } from "./viewport";

/** Number of the playback that is opened before the page. */
const FIRST_PLAYBACK = 1;

export class EarlyStage {
  readonly engine: EngineConnection;
  readonly displayName: string;
  readonly reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
  /** Session or motion that was entered; null if there is none, or not yet. */
  opened: PlaybackRequest | null = null;
  /** Resolves with `opened` once it does not change any more. Does not reject: the page tries again and reports why. */
  readonly entered: Promise<PlaybackRequest | null>;
  /** Events until the page listens; null afterwards. */
  #events: EngineEvent[] | null = [];
  #listener: (event: EngineEvent) => void = () => undefined;

  /** Enter the session or motion that the address names, else the running session. Call `start` once afterwards. */
  constructor(
    canvas: HTMLCanvasElement,
    readonly query: URLSearchParams,
    private readonly options: EngineOptions,
    private readonly startup: StartupSequence,
  ) {
    this.engine = new EngineConnection(canvas, options, (event) => this.#onEvent(event));
    this.displayName = resolveDisplayName(query, Math.random());
    this.entered = this.#enter().catch(() => null);
  }

  /** Start the engine, in the worker if there is one. */
  async start(worker: Promise<Worker | null>): Promise<void> {
    this.engine.post({
      type: "set",
      settings: {
        theme: applyTheme(),
        reducedMotion: this.reducedMotion.matches,
        isHidden: document.hidden,
        viewport: describeViewport(this.options.view !== null, null),
      },
    });
    // Nothing will be drawn, or it is not known what: the page says why.
    void this.entered.then((opened) => opened ?? this.startup.buildPage());
    await this.engine.start(await worker);
  }

  /** Call `listener` with the events of the engine, first with those until now. */
  listen(listener: (event: EngineEvent) => void): void {
    const events = this.#events ?? [];
    this.#events = null;
    this.#listener = listener;
    for (const event of events) listener(event);
  }

  async #enter(): Promise<PlaybackRequest | null> {
    const session = this.query.get("session");
    const motion = this.query.get("motion");
    if (session) return this.#open(session, "sessions");
    if (motion) return this.#open(motion, "motions");
    const [running] = (await listSessions(undefined, pageAccess)).items;
    if (!running) return null;
    const opened = this.#open(running.id, "sessions");
    if (this.reducedMotion.matches && running.viewers === 0)
      this.engine.post({ type: "edit", change: { playing: false } });
    return opened;
  }

  #open(id: string, kind: PlaybackKind): PlaybackRequest {
    this.opened = { number: FIRST_PLAYBACK, id, kind, name: this.displayName };
    this.engine.post({ type: "open", playback: this.opened });
    return this.opened;
  }

  #onEvent(event: EngineEvent): void {
    const { startup } = this;
    if (event.type === "loaded") startup.loadPage();
    else if (event.type === "ready") startup.onStageReady();
    else if (event.type === "unavailable") startup.finish();
    else if (event.type === "frame" && event.changes?.hasDrawnPerformer) {
      document.documentElement.dataset["drawn"] = "";
      startup.finish();
    }
    if (this.#events) this.#events.push(event);
    else this.#listener(event);
  }
}
