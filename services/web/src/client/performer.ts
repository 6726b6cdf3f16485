/** Live performer: brings a figure on the stage of a session and sends its poses (`proto/server.md`, 6.6). */

import { toRotationVector } from "../motion/rotation";
import { JOINT_COUNT } from "../motion/skeleton";
import { ReferenceClock } from "../playout/clock";
import { MAX_ROOT_M, packSample } from "../wire/fixed-message";
import type { Message, Ping, Pong } from "../wire/messages";
import { type Access, pageAccess } from "./access";
import { createPerformer, endPerformer, type LivePerformer, type NewPerformer } from "./api";
import { PingSender } from "./ping-sender";
import { ProblemError } from "./problem";
import { ReconnectingConnection } from "./reconnecting-connection";

const UNITS_PER_RADIAN = 32767 / Math.PI;
const OPEN_TIMEOUT_MS = 10_000;
/** Time without an answer, after which another connection is made. The server closes the connection before it. */
const SILENCE_TIMEOUT_MS = 5_000;
/** Time in which the last samples are received before the performance ends. */
const FLUSH_TIMEOUT_MS = 3_000;
/** Number of the Ping after the last sample. */
const LAST_PING = 0xffffffff;

/** Options of a live performer. */
export interface PerformerOptions extends NewPerformer {
  /** Server and credentials, which include the role `ingest`; those of the page by default. */
  access?: Access;
}

/**
 * Live performer on the stage of a session. A lost connection is established again; the performance goes on if that
 * takes less than 30 s.
 *
 * Events:
 * - "open": there is a new connection, and poses can be sent.
 * - "closed" (detail: the reason): the connection is lost, or closed for good if `isClosed`.
 * - "ended" (detail: the reason): the performance has ended, here, by the server or by another client.
 */
export class Performer extends EventTarget {
  /** True if the connection is closed for good. */
  isClosed = false;
  /** Number of samples sent. */
  sent = 0;

  private readonly clock = new ReferenceClock();
  private readonly pings = new PingSender(
    (ping) => this.sendPing(ping),
    () => performance.now(),
  );
  private connection: ReconnectingConnection;
  private isSynchronised = false;
  private silenceTimer: ReturnType<typeof setTimeout> | undefined;
  private onFlushed: () => void = () => undefined;
  private ending: Promise<void> | null = null;
  private readonly onPageHidden = () => void endPerformer(this.description.id, this.access).catch(() => undefined);

  /** Bring a performer on a stage. Resolve when its poses can be sent. */
  static async open({ access = pageAccess, ...request }: PerformerOptions = {}): Promise<Performer> {
    const performer = new Performer(await createPerformer(request, access), access);
    try {
      await performer.waitUntilOpen();
    } catch (error) {
      await performer.close().catch(() => undefined);
      throw error;
    }
    return performer;
  }

  private constructor(
    /** The performer as the server describes it. */
    readonly description: Readonly<LivePerformer>,
    private readonly access: Access,
  ) {
    super();
    this.connection = this.connect();
    globalThis.addEventListener?.("pagehide", this.onPageHidden);
  }

  /** Id of the session. */
  get session(): string {
    return this.description.session;
  }

  /** Id of the motion that is in the library when the performance has ended. */
  get motion(): string {
    return this.description.motion;
  }

  /** True if poses can be sent. */
  get isOpen(): boolean {
    return this.isSynchronised && this.connection.isOpen;
  }

  /**
   * Send a pose. Return false if it is lost, because the connection is.
   *
   * @param root position in metres: x, y up, z
   * @param rotations unit quaternions w x y z of the 18 `JOINTS`, each in the frame of its parent
   * @param time capture time, milliseconds of `performance.now`
   * @throws RangeError for a pose that the server would reject
   */
  frame(root: ArrayLike<number>, rotations: ArrayLike<number>, time = performance.now()): boolean {
    const [x, y, z] = Array.from(root);
    if (root.length !== 3 || ![x, y, z].every((coordinate) => Math.abs(coordinate) <= MAX_ROOT_M))
      throw new RangeError(`root is [${Array.from(root)}], expected 3 numbers within ${MAX_ROOT_M} m`);
    const quaternions = Float64Array.from(rotations);
    if (quaternions.length !== 4 * JOINT_COUNT || !quaternions.every(Number.isFinite))
      throw new RangeError(`rotations has ${quaternions.length} numbers, expected ${4 * JOINT_COUNT} finite ones`);
    if (!this.isOpen || this.ending) return false;
    const vectors = new Float64Array(3 * JOINT_COUNT);
    for (let joint = 0; joint < JOINT_COUNT; joint++) toRotationVector(vectors, 3 * joint, quaternions, 4 * joint);
    const units = Int16Array.from(vectors, (value) => Math.round(value * UNITS_PER_RADIAN));
    const sampled = Math.round(this.clock.at(time * 1000));
    this.sent++;
    return this.connection.sendBytes(
      packSample({ name: "Sample", sequence: this.sent, sampled, root: [x, y, z], rotations: units }),
    );
  }

  /**
   * End the performance once the server has received all poses. Its motion then appears in the library.
   *
   * @throws ProblemError if the server is unreachable; it then ends the performance by itself
   */
  close(): Promise<void> {
    this.ending ??= this.end();
    return this.ending;
  }

  private async end(): Promise<void> {
    try {
      await this.flush();
      await endPerformer(this.description.id, this.access);
    } catch (error) {
      // ended already, by another client or by the server
      if (!(error instanceof ProblemError && error.status === 404)) throw error;
    } finally {
      this.connection.close();
    }
  }

  /** Wait until the server has received all samples: it answers a Ping after them. */
  private async flush(): Promise<void> {
    if (!this.isOpen) return;
    await new Promise<void>((resolve) => {
      const timer = setTimeout(resolve, FLUSH_TIMEOUT_MS);
      this.onFlushed = () => {
        clearTimeout(timer);
        resolve();
      };
      this.connection.send({ name: "Ping", sequence: LAST_PING, sent: Math.round(performance.now() * 1000) });
    });
  }

  private async waitUntilOpen(): Promise<void> {
    const settled = new AbortController();
    await new Promise<void>((resolve, reject) => {
      const { signal } = settled;
      this.addEventListener("open", () => resolve(), { signal });
      this.addEventListener("ended", (event) => reject(new Error((event as CustomEvent<string>).detail)), { signal });
      const timer = setTimeout(() => reject(new Error("the server does not answer")), OPEN_TIMEOUT_MS);
      signal.addEventListener("abort", () => clearTimeout(timer));
    }).finally(() => settled.abort());
  }

  private connect(): ReconnectingConnection {
    const url = new URL(this.description.input, this.access.server || globalThis.location.href);
    url.protocol = url.protocol.replace("http", "ws");
    const ifCurrent = (handle: () => void) => connection === this.connection && handle();
    const connection: ReconnectingConnection = new ReconnectingConnection({
      url: () => this.access.authorizeSocketUrl(url.href),
      translator: this.access.translator,
      onOpen: () => ifCurrent(() => this.onOpen()),
      onMessage: (message) => ifCurrent(() => this.onMessage(message)),
      onMalformed: () => undefined,
      onClosed: (reason, final) => ifCurrent(() => this.onClosed(reason, final)),
    });
    this.awaitAnswer();
    return connection;
  }

  /**
   * Make a new connection in place of a silent one. The two are not tried side by side, as those of a viewer, since a
   * performer has one connection.
   */
  private replaceConnection(): void {
    this.silenceTimer = undefined;
    const silent = this.connection;
    const wasOpen = this.isOpen;
    this.pings.pause();
    this.isSynchronised = false;
    this.connection = this.connect();
    silent.close();
    if (wasOpen) this.dispatch("closed", this.access.translator.translate("the connection was lost"));
  }

  private onOpen(): void {
    this.clock.restart();
    this.pings.restart();
  }

  private onMessage(message: Message): void {
    if (message.name === "Pong") this.onPong(message);
  }

  private onPong({ sequence, sent, received, answered }: Pong): void {
    this.stopSilenceTimer();
    if (sequence === LAST_PING) {
      this.onFlushed();
      return;
    }
    this.clock.addSample(sent, received, answered, performance.now() * 1000);
    this.pings.onPong(sequence);
    if (this.isSynchronised || !this.clock.hasEstimate) return;
    this.isSynchronised = true;
    this.dispatchEvent(new Event("open"));
  }

  private onClosed(reason: string, final: boolean): void {
    this.isSynchronised = false;
    this.isClosed = final;
    this.pings.pause();
    this.onFlushed();
    this.dispatch("closed", reason);
    if (!final) {
      this.awaitAnswer();
      return;
    }
    this.stopSilenceTimer();
    globalThis.removeEventListener?.("pagehide", this.onPageHidden);
    this.dispatch("ended", reason);
  }

  private sendPing(ping: Ping): boolean {
    const isSent = this.connection.send(ping);
    if (isSent) this.awaitAnswer();
    return isSent;
  }

  /** Start the time until the connection is replaced, unless it runs. */
  private awaitAnswer(): void {
    this.silenceTimer ??= setTimeout(() => this.replaceConnection(), SILENCE_TIMEOUT_MS);
  }

  private stopSilenceTimer(): void {
    clearTimeout(this.silenceTimer);
    this.silenceTimer = undefined;
  }

  private dispatch(name: "closed" | "ended", reason: string): void {
    this.dispatchEvent(new CustomEvent(name, { detail: reason }));
  }
}
