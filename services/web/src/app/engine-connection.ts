/**
 * Connection of the page to its engine. The engine runs in a worker if the browser can draw there, otherwise in the
 * page; both receive and send the same messages.
 */
import type {
  EngineCommand,
  EngineEvent,
  EngineFailure,
  EngineOptions,
  EngineRequest,
  EngineResults,
} from "../engine/message";
import type { EngineStart } from "../engine/worker";

/** Failure of a request to the engine. */
export class EngineError extends Error {
  override readonly name = "EngineError";

  constructor(readonly failure: EngineFailure) {
    super(failure.message);
  }
}

interface PendingRequest {
  resolve(result: never): void;
  reject(error: EngineError): void;
}

export class EngineConnection {
  /** Messages of the time before the engine runs; null afterwards. */
  #queue: EngineCommand[] | null = [];
  #send: (command: EngineCommand) => void = () => undefined;
  readonly #pending = new Map<number, PendingRequest>();
  #lastRequest = 0;

  /** `onEvent` receives all events but the responses to requests. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly options: EngineOptions,
    private readonly onEvent: (event: EngineEvent) => void,
  ) {}

  /** Start the engine in `worker`, or in the page without one. What was sent before is delivered then. */
  async start(worker: Worker | null): Promise<void> {
    if (worker) this.#startInWorker(worker);
    else if (!(await this.#startInPage())) {
      this.#fail();
      return;
    }
    const queue = this.#queue ?? [];
    this.#queue = null;
    for (const command of queue) this.#send(command);
  }

  post(command: EngineCommand): void {
    if (this.#queue) this.#queue.push(command);
    else this.#send(command);
  }

  /** Send a request. Rejects with EngineError. */
  request<Request extends EngineRequest>(request: Request): Promise<EngineResults[Request["kind"]]> {
    const id = ++this.#lastRequest;
    return new Promise((resolve, reject) => {
      this.#pending.set(id, { resolve, reject });
      this.post({ type: "request", id, request });
    });
  }

  /** Give the canvas to the worker. */
  #startInWorker(worker: Worker): void {
    // Errors of the worker are errors of the page.
    worker.onerror = (event) => {
      event.preventDefault();
      reportError(new Error(`Error in the engine: ${event.message} (${event.filename}:${event.lineno})`));
    };
    worker.onmessage = ({ data }: MessageEvent<EngineEvent>) => this.#onEvent(data);
    const canvas = this.canvas.transferControlToOffscreen();
    worker.postMessage({ type: "start", canvas, options: this.options } satisfies EngineStart, [canvas]);
    this.#send = (command) => worker.postMessage(command);
  }

  /** Start the engine in the page. Messages are copied and delivered later, as with a worker. */
  async #startInPage(): Promise<boolean> {
    const module = await import("../engine/engine").catch(() => null);
    if (!module) return false;
    const { port1, port2 } = new MessageChannel();
    const engine = new module.Engine(this.canvas, this.options, (event) => port2.postMessage(event));
    port1.onmessage = ({ data }: MessageEvent<EngineEvent>) => this.#onEvent(data);
    port2.onmessage = ({ data }: MessageEvent<EngineCommand>) => engine.handle(data);
    this.#send = (command) => port1.postMessage(command);
    void engine.start();
    return true;
  }

  /** Report that there is no engine, drop what was sent to it, and reject all requests. */
  #fail(): void {
    this.#queue = null;
    const failure = { known: null, message: "The engine of this page could not be loaded." };
    this.#send = (command) => {
      if (command.type === "request") this.#onEvent({ type: "response", id: command.id, failure });
    };
    for (const id of [...this.#pending.keys()]) this.#onEvent({ type: "response", id, failure });
    this.onEvent({ type: "unavailable", reason: "not loaded" });
  }

  #onEvent(event: EngineEvent): void {
    if (event.type !== "response") {
      this.onEvent(event);
      return;
    }
    const pending = this.#pending.get(event.id);
    this.#pending.delete(event.id);
    if (event.failure) pending?.reject(new EngineError(event.failure));
    else pending?.resolve(event.result as never);
  }
}
