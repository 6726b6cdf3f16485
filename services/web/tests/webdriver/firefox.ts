/**
 * Firefox through WebDriver BiDi (W3C Working Draft), which the browser itself serves: Debian has no geckodriver.
 */
import type { ChildProcess } from "node:child_process";
import { mkdirSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Readable } from "node:stream";
import type { Browser, BrowserSession, BrowserWindow, SessionOptions, WindowSize } from "./browser";
import { COMMAND_TIMEOUT_MS } from "./browser";
import {
  findInOutput,
  removeFolder,
  startProcess,
  startVirtualDisplay,
  startVirtualSpeaker,
  stopProcess,
  type VirtualDisplay,
  type VirtualSpeaker,
} from "./processes";

type Parameters = Record<string, unknown>;

/** Connection to the browser: commands with their responses, and events. */
class BidiConnection {
  onEvent: (method: string, parameters: Parameters) => void = () => undefined;
  readonly #socket: WebSocket;
  readonly #pending = new Map<number, { resolve(result: Parameters): void; reject(error: Error): void }>();
  #lastId = 0;

  private constructor(socket: WebSocket) {
    this.#socket = socket;
    socket.addEventListener("message", ({ data }) => this.#receive(JSON.parse(String(data))));
    socket.addEventListener("close", () => {
      for (const { reject } of this.#pending.values()) reject(new Error("Firefox closed the BiDi connection"));
    });
  }

  static open(url: string): Promise<BidiConnection> {
    const socket = new WebSocket(url);
    return new Promise((resolve, reject) => {
      socket.addEventListener("open", () => resolve(new BidiConnection(socket)));
      socket.addEventListener("error", () => reject(new Error(`Firefox refused the BiDi connection to ${url}`)));
    });
  }

  send<Result>(method: string, parameters: Parameters = {}): Promise<Result> {
    const id = ++this.#lastId;
    this.#socket.send(JSON.stringify({ id, method, params: parameters }));
    return new Promise((resolve, reject) => {
      const fail = (error: Error) => {
        clearTimeout(timeout);
        reject(new Error(`${method}: ${error.message}`));
      };
      const timeout = setTimeout(() => fail(new Error("Firefox did not answer in time")), COMMAND_TIMEOUT_MS);
      const succeed = (result: Parameters) => {
        clearTimeout(timeout);
        resolve(result as Result);
      };
      this.#pending.set(id, { resolve: succeed, reject: fail });
    });
  }

  close(): void {
    this.#socket.close();
  }

  #receive(message: { id?: number; method?: string; params?: Parameters; result?: Parameters; message?: string }) {
    if (message.method !== undefined) {
      this.onEvent(message.method, message.params ?? {});
      return;
    }
    const pending = this.#pending.get(message.id ?? 0);
    this.#pending.delete(message.id ?? 0);
    if (message.result) pending?.resolve(message.result);
    else pending?.reject(new Error(message.message));
  }
}

/** Preferences beside those that Firefox sets itself under remote control. */
const PREFERENCES = {
  // Mesa's software renderer is on the list of blocked drivers.
  "webgl.force-enabled": true,
  "dom.w3c_touch_events.enabled": 1,
  // Software rendering at the full rate would take all processors.
  "layout.frame_rate": 10,
  // Fewer processes start faster.
  "dom.ipc.processPrelaunch.enabled": false,
  "fission.autostart": false,
  // A speaker within Firefox, which no server can keep waiting. Firefox 140 ignores this and uses the other one.
  "media.cubeb.force_mock_context": true,
  "browser.download.folderList": 2,
  // The list of downloads would take the focus of the page, and its keys.
  "browser.download.alwaysOpenPanel": false,
  "ui.prefersReducedMotion": 1,
};

/**
 * Messages that are no errors of a page: a font that was loading when the page was left (NS_BINDING_ABORTED), and
 * sockets that it opens again.
 */
const NETWORK_MESSAGE =
  /^(downloadable font: download failed .*status=2152398850|Firefox can’t establish a connection|The connection to ws)/;

/** In the page, before its scripts: storage throws, as where a user blocks cookies and site data. */
function forbidStorage(): void {
  const get = () => {
    throw new DOMException("The operation is insecure.", "SecurityError");
  };
  for (const name of ["localStorage", "sessionStorage", "indexedDB"])
    Object.defineProperty(window, name, { get, configurable: true });
}

export async function startFirefox(program: string, ...options: string[]): Promise<Browser> {
  const folder = mkdtempSync(join(tmpdir(), "bunraku-firefox-"));
  const [profile, downloads] = [join(folder, "profile"), join(folder, "downloads")];
  for (const path of [profile, downloads]) mkdirSync(path);
  const preferences = { ...PREFERENCES, "browser.download.dir": downloads };
  writeFileSync(
    join(profile, "user.js"),
    Object.entries(preferences)
      .map(([name, value]) => `user_pref(${JSON.stringify(name)}, ${JSON.stringify(value)});\n`)
      .join(""),
  );
  // Without a display Firefox finds no software renderer for WebGL, even if it shows no windows.
  const display = await startVirtualDisplay();
  // Without a speaker an AudioContext never runs.
  const speaker = await startVirtualSpeaker(folder);
  const browser = startProcess(
    program,
    ["--headless", "--no-remote", "--profile", profile, "--remote-debugging-port", "0", ...options],
    { DISPLAY: display.name, PULSE_SERVER: speaker.address, HOME: folder, MOZ_CRASHREPORTER_DISABLE: "1" },
  );
  browser.stdout?.resume();
  const url = await findInOutput(browser, browser.stderr as Readable, /WebDriver BiDi listening on (ws:\S+)/);
  const connection = await BidiConnection.open(`${url}/session`);
  await connection.send("session.new", { capabilities: {} });
  await connection.send("session.subscribe", { events: ["log.entryAdded"] });
  return new Firefox(program, connection, browser, [display, speaker], folder, downloads);
}

class Firefox implements Browser {
  /** Receivers of errors, by window. */
  readonly #errors = new Map<string, string[]>();

  constructor(
    private readonly program: string,
    private readonly connection: BidiConnection,
    private readonly browser: ChildProcess,
    private readonly devices: (VirtualDisplay | VirtualSpeaker)[],
    private readonly folder: string,
    private readonly downloads: string,
  ) {
    connection.onEvent = (_method, { level, text, source }) => {
      const { context } = source as { context: string };
      if (level === "error" && !NETWORK_MESSAGE.test(String(text))) this.#errors.get(context)?.push(String(text));
    };
  }

  async openSession({ hasStorage = true, isPrivate = false }: SessionOptions = {}): Promise<BrowserSession> {
    if (isPrivate) return this.#openPrivateSession();
    const { connection, downloads } = this;
    const { userContext } = await connection.send<{ userContext: string }>("browser.createUserContext");
    if (!hasStorage)
      await connection.send("script.addPreloadScript", {
        functionDeclaration: String(forbidStorage),
        userContexts: [userContext],
      });
    const errors: string[] = [];
    return {
      errors,
      downloads,
      open: async (url, size) => {
        const { context } = await connection.send<{ context: string }>("browsingContext.create", {
          type: "window",
          userContext,
        });
        this.#errors.set(context, errors);
        const window = new FirefoxWindow(connection, context);
        if (size) await window.resize(size);
        await window.goto(url);
        return window;
      },
      close: async () => void (await connection.send("browser.removeUserContext", { userContext })),
    };
  }

  /** Start a browser whose first window is private, and the later ones too. BiDi opens none. */
  async #openPrivateSession(): Promise<BrowserSession> {
    const browser = await startFirefox(this.program, "--private-window", "about:blank");
    const session = await browser.openSession();
    const close = async () => {
      await session.close();
      await browser.close();
    };
    return { ...session, close };
  }

  async close(): Promise<void> {
    this.connection.close();
    await stopProcess(this.browser);
    await Promise.all(this.devices.map((device) => device.stop()));
    removeFolder(this.folder);
  }
}

class FirefoxWindow implements BrowserWindow {
  constructor(
    private readonly connection: BidiConnection,
    private readonly context: string,
  ) {}

  async resize(viewport: WindowSize): Promise<void> {
    await this.#send("browsingContext.setViewport", { viewport });
  }

  async goto(url: string): Promise<void> {
    await this.#send("browsingContext.navigate", { url, wait: "interactive" });
  }

  async call(declaration: string, argument: string): Promise<string> {
    const { result, exceptionDetails } = await this.connection.send<{
      result?: { value: string };
      exceptionDetails?: { text: string };
    }>("script.callFunction", {
      functionDeclaration: declaration,
      arguments: [{ type: "string", value: argument }],
      awaitPromise: true,
      target: { context: this.context },
    });
    if (!result) throw new Error(exceptionDetails?.text);
    return result.value;
  }

  async perform(...actions: unknown[]): Promise<void> {
    await this.#send("input.performActions", { actions });
  }

  async chooseFile(selector: string, path: string): Promise<void> {
    const locator = { type: "css", value: selector };
    const { nodes } = await this.#send<{ nodes: { sharedId: string }[] }>("browsingContext.locateNodes", { locator });
    await this.#send("input.setFiles", { element: { sharedId: nodes[0].sharedId }, files: [path] });
  }

  async screenshot(): Promise<string> {
    return (await this.#send<{ data: string }>("browsingContext.captureScreenshot")).data;
  }

  async close(): Promise<void> {
    await this.#send("browsingContext.close");
  }

  #send<Result>(method: string, parameters: Parameters = {}): Promise<Result> {
    return this.connection.send(method, { context: this.context, ...parameters });
  }
}
