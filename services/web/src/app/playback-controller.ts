/** Playback of the page: enter a session or a motion, show its state, and replace it by another. */
import { pageAccess } from "../client/access";
import { createSession, findOrCreateSession, getSession } from "../client/api";
import { ProblemError } from "../client/problem";
import type { EngineCommand, PlaybackChange, PlaybackRequest, ViewerTime } from "../engine/message";
import { translate } from "../i18n/translator";
import { showProblem } from "../ui/library/problem-report";
import type { Page } from "../ui/page";
import { PHONE } from "../ui/window-shape";
import type { AvatarSlots } from "./avatar-slot";
import type { EarlyStage } from "./early-stage";
import type { LibraryController } from "./library-controller";
import { RemotePlayback } from "./remote-playback";
import { restorePosition } from "./saved-position";
import type { SoundController } from "./sound-controller";
import type { StartupSequence } from "./startup";

export interface PlaybackControllerOptions {
  page: Page;
  startup: StartupSequence;
  /** Matches if the user prefers less motion: a session without viewers then starts paused. */
  reducedMotion: MediaQueryList;
  /** What was entered before the page was loaded. */
  early: Pick<EarlyStage, "displayName" | "entered" | "opened">;
  library: LibraryController;
  soundController: SoundController;
  avatarSlots: AvatarSlots;
  /** Send a message to the engine. */
  send(command: EngineCommand): void;
}

export class PlaybackController {
  #current: RemotePlayback | null = null;
  /** Number of the playback that was opened last. */
  #lastNumber = 0;
  #accessDenied = false;

  constructor(private readonly options: PlaybackControllerOptions) {
    pageAccess.onUnauthorized((problem) => this.onUnauthorized(problem));
  }

  /** The session or motion on the stage; null before one was entered. */
  get current(): RemotePlayback | null {
    return this.#current;
  }

  /** Apply a change of a playback. */
  onChange(playback: number, change: PlaybackChange): void {
    if (this.#current?.number === playback) this.#current.apply(change);
  }

  /** Set the time of a playback. */
  onTime(playback: number, time: ViewerTime | null): void {
    if (this.#current?.number === playback) this.#current.setTime(time);
  }

  /** Report a rejected token. */
  onUnauthorized({ title, detail, hint }: Pick<ProblemError, "title" | "detail" | "hint">): void {
    const { page } = this.options;
    this.#accessDenied = true;
    // A connection that was rejected for the same reason may have been reported before.
    page.notice("dance", null);
    page.notice("access", title, hint ? translate("{detail}; {hint}.", { detail, hint }) : detail);
  }

  togglePlaying(): void {
    const timeline = this.#current?.timeline;
    if (timeline) this.#current?.edit({ playing: !timeline.playing });
  }

  toggleLoop(): void {
    this.#current?.edit({ loop: !this.#current.timeline?.loop });
  }

  /** Show the session or motion that was entered early; without one, enter the running session, else a new one. */
  async start(): Promise<void> {
    const { early, library, page, reducedMotion, startup } = this.options;
    try {
      // The stage does not wait for the library: the list is fetched at the same time.
      const listed = library.refresh();
      const newest = listed.then(() => library.motions.items[0]?.id ?? null);
      // Failures are handled where these promises are awaited below.
      for (const promise of [listed, newest]) promise.catch(() => undefined);
      const opened = early.opened ?? (await early.entered);
      if (opened) {
        const playback = this.#show(opened);
        if (opened.kind === "motions") restorePosition(playback);
      } else {
        const session = await findOrCreateSession(newest);
        const playback = session && this.#open(session.id);
        if (playback && reducedMotion.matches && session.viewers === 0) playback.edit({ playing: false });
      }
      await listed;
      if (!this.#current) this.#showEmptyStage();
    } catch (error) {
      startup.finish();
      if (!(error instanceof ProblemError)) throw error;
      if (this.#accessDenied) return;
      const { title, detail, hint } = error;
      page.notice("dance", title, translate("{detail}. {hint}", { detail, hint: hint ?? "" }));
    }
  }

  /**
   * Put a motion on the stage: in the session, for all its viewers, or in a new session if there is none. On a phone
   * the library is closed, unless `keepsLibrary`.
   */
  async playMotion(id: string, keepsLibrary = false): Promise<void> {
    const { library, page, reducedMotion } = this.options;
    if (!pageAccess.allows("control")) return;
    try {
      if (this.#current) {
        this.#current.edit({ motion: id, position: 0 });
      } else {
        const session = await createSession(id);
        const playback = this.#open(session.id);
        if (reducedMotion.matches) playback.edit({ playing: false });
      }
      if (PHONE.matches && !keepsLibrary) page.panels.close("library");
    } catch (error) {
      showProblem(page.library, library.motions.find(id)?.name ?? translate("This dance"), error);
    }
  }

  /** Put an uploaded motion on the stage, even if the list cannot be fetched now. */
  async playUploadedMotion(id: string, keepsLibrary = false): Promise<void> {
    await this.options.library.refresh().catch(() => undefined);
    await this.playMotion(id, keepsLibrary);
  }

  /** Enter a session, and leave the current one. */
  #open(id: string): RemotePlayback {
    const { early, send } = this.options;
    const playback: PlaybackRequest = { number: this.#lastNumber + 1, id, kind: "sessions", name: early.displayName };
    send({ type: "open", playback });
    return this.#show(playback);
  }

  /** Show a session or motion that the engine enters. */
  #show({ number, id, kind }: PlaybackRequest): RemotePlayback {
    const { library, page, send, soundController, startup } = this.options;
    const playback = new RemotePlayback(number, id, kind, send);
    this.#lastNumber = number;
    this.#current = playback;
    document.documentElement.toggleAttribute("data-own", kind === "motions");
    startup.runWhenFinished(() => this.#current === playback && soundController.setViewer(playback));
    const url = new URL(location.href);
    url.searchParams.set(kind === "motions" ? "motion" : "session", id);
    history.replaceState(null, "", url);
    page.notice("dance", null);
    page.toast.showDisconnected(null);
    this.#bindMotion(playback);
    this.#bindTransport(playback);
    this.#bindPresence(playback);
    this.#bindConnection(playback);
    library.render();
    return playback;
  }

  /** Show the performers and the name of the motion whenever they change. */
  #bindMotion(playback: RemotePlayback): void {
    const { avatarSlots, library } = this.options;
    const updatePerformers = () => avatarSlots.restore(playback.performerCount);
    playback.addEventListener("figure", () => {
      updatePerformers();
      library.render();
      void this.#findMotion(playback).catch(() => undefined);
    });
    playback.addEventListener("tracks", updatePerformers);
  }

  /** Find the motion in the library: a new one, or that which is played with live performers. */
  async #findMotion(playback: RemotePlayback): Promise<void> {
    const { library } = this.options;
    const { id, kind, motion } = playback;
    if (library.motions.find(motion)) return;
    await library.refresh();
    if (library.motions.find(motion) || kind !== "sessions") return;
    const { base } = await getSession(id);
    if (playback.motion !== motion) return;
    playback.base = base;
    library.render();
  }

  #bindTransport(playback: RemotePlayback): void {
    const { transport } = this.options.page;
    const renderTimeline = () => {
      const { timeline } = playback;
      transport.setTimeline(timeline?.playing ?? false, timeline?.loop ?? false, timeline !== null);
    };
    playback.addEventListener("timeline", renderTimeline);
    playback.addEventListener("blocks", () => transport.setBlocks(playback.blocks, playback.levelCount));
    renderTimeline();
  }

  #bindPresence(playback: RemotePlayback): void {
    const { page, startup } = this.options;
    const render = () =>
      startup.runWhenFinished(
        () => this.#current === playback && page.header.renderPeople(playback.presence, playback.puppeteerId),
      );
    playback.addEventListener("presence", render);
    playback.addEventListener("welcome", render);
    const renderProps = () => page.strings.renderProps(playback.presence?.props ?? []);
    playback.addEventListener("presence", renderProps);
    renderProps();
  }

  #bindConnection(playback: RemotePlayback): void {
    const { page } = this.options;
    playback.addEventListener("open", () => {
      page.notice("dance", null);
      page.toast.showDisconnected(null);
    });
    playback.addEventListener("closed", (event) => {
      const { isClosed, isConnected, kind } = playback;
      const reason = String((event as CustomEvent<string>).detail);
      if (isClosed || this.#accessDenied) page.toast.showDisconnected(null);
      if (this.#accessDenied) return;
      if (isClosed)
        page.notice("dance", translate(kind === "motions" ? "The dance has ended" : "The session has ended"), reason);
      else if (isConnected)
        page.toast.showDisconnected(translate("Connection lost, reconnecting: {reason}", { reason }));
    });
  }

  #showEmptyStage(): void {
    const { page, startup } = this.options;
    startup.finish();
    const title = translate("The stage is empty");
    if (!pageAccess.allows("ingest")) {
      page.notice("dance", title, translate("No performance is running now. Come back later."));
      return;
    }
    page.notice(
      "dance",
      title,
      translate("Drop a motion capture file anywhere on this page, or open the library, and the puppet dances it."),
    );
    page.panels.open("library");
  }
}
