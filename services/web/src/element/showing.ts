/** One stage at work: from when its element comes into a document until it has left it. The element's wiring. */
import type { SoundMemory } from "../audio/preference";
import { Access, tabToken } from "../client/access";
import { ProblemError } from "../client/problem";
import { whyUnreached } from "../client/reach";
import { Holding } from "../holding";
import { Listening } from "../listening";
import { ownName } from "../page/name";
import { findSession, Room } from "../room";
import type { Speech } from "../words/say";
import { Drawing } from "./drawing";
import { createFace, type Face } from "./face";
import { readSource, type Source } from "./source";

/** What its element is told: the name of an event, and its detail. */
export type Tell = (event: "ready" | "welcome" | "presence" | "closed" | "error", detail?: unknown) => void;

/** A server that is away is asked again after this, milliseconds. */
const AGAIN = 4_000;
/** The status of one that says so itself. */
const AWAY = 503;

export class Showing {
  room: Room | null = null;
  readonly drawing: Drawing;
  readonly listening: Listening;
  readonly #face: Face;
  readonly #holding: Holding;
  #controls = false;
  /** Whether there is sound to be heard. */
  #sounds = false;
  #closed = false;
  #blind = false;
  #said: string | null = null;
  #again: ReturnType<typeof setTimeout> | undefined;
  /** Counts what was asked for: what comes too late is not shown. */
  #asked = 0;

  /** In `root`; all that it says it says in `speech`. `memory` knows whether sound is wanted. */
  constructor(private readonly root: ShadowRoot, private readonly speech: Speech, memory: SoundMemory, private readonly tell: Tell) {
    this.#face = createFace(root, {
      play: () => this.play(!this.playing),
      toggle: (limb) => this.#holding.toggle(limb),
      focus: (limb) => (this.drawing.focused = limb),
      ask: (limb) => this.#holding.ask(limb),
      give: (limb) => this.#holding.give(limb),
      nextDancer: () => this.#holding.nextDancer(),
      sound: () => this.listening.toggle(),
    }, speech);
    const { toast, asks } = this.#face;
    this.#holding = new Holding({
      asks,
      toast,
      strings: { render: (limbs, ready, chosen) => this.#face.limbs(limbs, this.#hands, ready, chosen), notice: (text) => toast(text) },
    }, () => this.drawing.mapping, speech);
    this.#holding.watching = true;
    this.listening = new Listening(({ there, heard }) => {
      this.#face.sound(there, heard);
      this.#sounds = there;
      this.#bar();
    }, this.#face.soundButton, memory);
    this.drawing = new Drawing(this.#face, this.#holding);
    this.drawing.begun = () => this.tell("ready");
    void this.#draw();
  }

  get playing(): boolean {
    return this.room?.viewer.timeline?.playing ?? false;
  }

  /** Plays or pauses: a session for everyone, where that is allowed. */
  play(playing: boolean): void {
    this.room?.edit({ playing });
  }

  seek(seconds: number): void {
    this.room?.seek(seconds, performance.now());
  }

  /** Shows what `src` names (null: nothing), with controls or only to be watched. */
  async show(src: string | null, controls: boolean): Promise<void> {
    const asked = ++this.#asked;
    this.#controls = controls;
    this.#leave();
    this.drawing.controls = controls;
    // without graphics nothing is asked for
    if (this.#blind) return;
    this.#clear();
    if (src === null) return;
    const source = readSource(src, document.baseURI);
    const { say } = this.speech;
    if (!source) return this.#fail(say("No stage is here"), say("{address} is no address of a stage.", { address: JSON.stringify(src) }));
    const own = source.server === location.origin ? tabToken() : null;
    await this.#find(source, new Access(source.server, source.token ?? own, this.speech), asked);
  }

  /** Ends it for good: its sockets, its listening and its graphics. */
  close(): void {
    this.#closed = true;
    this.#leave();
    this.listening.close();
    this.drawing.close();
    this.#face.remove();
  }

  /** Whether limbs can be taken from here. */
  get #hands(): boolean {
    return this.#controls && this.room?.place === "sessions" && this.room.access.may("control");
  }

  /** Enters what a source names, and tries again while its server is away. */
  async #find(source: Source, access: Access, asked: number): Promise<void> {
    const { say } = this.speech;
    try {
      const id = source.id ?? (await findSession(Promise.resolve(null), access))?.id ?? null;
      if (asked !== this.#asked || this.#closed) return;
      if (id === null) this.#fail(say("The stage is empty"), say("Nobody dances here now. Come again when somebody does."));
      else this.#enter(source, id, access);
    } catch (error) {
      if (asked !== this.#asked || this.#closed) return;
      if (!(error instanceof ProblemError)) throw error;
      const final = error.status === 0 ? await this.#unreached(source.server, asked) : error.status !== AWAY;
      if (error.status !== 0) this.#problem(error);
      if (final || asked !== this.#asked || this.#closed) return;
      this.#again = setTimeout(() => void this.#find(source, access, asked), AGAIN);
    }
  }

  #enter({ place, query, server }: Source, id: string, access: Access): void {
    const asked = this.#asked;
    const { say } = this.speech;
    const failed = (error: unknown) => this.#face.toast(error instanceof ProblemError ? error.message : String(error));
    const room = new Room(id, ownName(query, Math.random()), failed, { place, access, watching: !this.#controls });
    this.room = room;
    const { viewer, puppeteer } = room;
    let denied = false;
    let opened = false;
    access.whenDenied((problem) => {
      denied = true;
      if (this.room === room) this.#problem(problem);
    });
    this.#holding.watching = !this.#hands;
    this.#holding.enter(room);
    this.drawing.enter(room);
    this.listening.enter(viewer);
    (this.root.host as HTMLElement).toggleAttribute("data-hands", this.#hands);
    const during = (target: EventTarget, event: string, then: (event: Event) => void) =>
      target.addEventListener(event, (told) => {
        if (this.room === room) then(told);
      });
    for (const news of ["figure", "tracks"]) during(viewer, news, () => this.drawing.performing?.comeOn());
    during(viewer, "timeline", () => this.#bar());
    during(viewer, "presence", () => this.tell("presence", viewer.presence));
    during(puppeteer, "welcome", () => this.tell("welcome", { id: puppeteer.id, colour: puppeteer.colour }));
    during(viewer, "open", () => {
      // asked for less motion, a dance of one's own waits
      if (this.drawing.still && !opened && place === "motions") room.edit({ playing: false });
      opened = true;
      this.#holding.connected = true;
      this.#holding.render();
      this.#face.toast.lost(null);
      this.#clear();
    });
    during(viewer, "closed", (event) => {
      const reason = String((event as CustomEvent<string>).detail);
      const wasConnected = this.#holding.connected;
      this.#holding.connected = false;
      this.#holding.render();
      this.tell("closed", { reason, final: viewer.ended });
      if (viewer.ended || denied) this.#face.toast.lost(null);
      if (denied) return;
      if (viewer.ended) this.#face.notice(say(place === "motions" ? "The dance has ended" : "The session has ended"), reason);
      else if (!opened) void this.#unreached(server, asked);
      else if (wasConnected) this.#face.toast.lost(say("The line was lost: {reason}", { reason }));
    });
    this.#bar();
    this.#holding.render();
  }

  #leave(): void {
    const { room } = this;
    clearTimeout(this.#again);
    this.room = null;
    this.drawing.enter(null);
    this.listening.enter(null);
    this.#holding.connected = false;
    room?.close();
    (this.root.host as HTMLElement).removeAttribute("data-hands");
    this.#face.toast.lost(null);
    this.#face.bar(false, null);
  }

  /** Says why no word comes from a server, and gives up, and returns true, where none will. */
  async #unreached(server: string, asked: number): Promise<boolean> {
    const { say } = this.speech;
    const why = await whyUnreached(server, location.origin, this.speech);
    // it can be reached, but what was asked of it cannot be had
    const { title, text, final } = why ?? { title: say("The stage does not answer"), text: say("Its server cannot show it now. It is tried again and again."), final: false };
    if (asked !== this.#asked || this.#closed || this.#holding.connected) return false;
    if (final) this.#leave();
    this.#fail(title, text);
    return final;
  }

  #problem({ title, detail, hint }: ProblemError): void {
    this.#fail(title, hint ? this.speech.say("{detail}; {hint}.", { detail, hint }) : detail);
  }

  /** Says what is in the way: once, however often it is met. */
  #fail(title: string, text: string): void {
    const said = this.speech.say("{title}: {detail}", { title, detail: text });
    if (said === this.#said) return;
    this.#said = said;
    this.#face.notice(title, text);
    this.tell("error", said);
  }

  #clear(): void {
    this.#said = null;
    this.#face.notice(null);
  }

  #bar(): void {
    const { room } = this;
    const editable = room?.editable ?? false;
    this.#face.bar(this.#controls && room !== null && (editable || this.#hands || this.#sounds), editable ? this.playing : null);
  }

  async #draw(): Promise<void> {
    const missing = await this.drawing.open({
      next_dancer: () => this.#holding.nextDancer(), ask: () => this.#holding.ask(), give: () => this.#holding.give(), play: () => this.play(!this.playing), sound: () => this.listening.toggle(),
      back: () => this.room?.step(-1, performance.now()), forward: () => this.room?.step(1, performance.now()),
    });
    if (!missing) return;
    this.#blind = true;
    this.#asked++;
    this.#leave();
    const { say } = this.speech;
    if (missing === "not loaded") this.#fail(say("The stage does not answer"), say("What draws it could not be loaded. Load this page again."));
    else this.#fail(say("This browser cannot draw the stage"), say("It needs WebGL 2. Try another browser, or switch on hardware acceleration."));
  }
}
