/** WebKitGTK through its driver, by the HTTP protocol of W3C WebDriver. */
import type { ChildProcess } from "node:child_process";
import { mkdirSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import {
  type Browser,
  type BrowserSession,
  type BrowserWindow,
  COMMAND_TIMEOUT_MS,
  type InputDevice,
  type PointerAction,
  type SessionOptions,
  type WindowSize,
} from "./browser";
import {
  findFreePort,
  killProcessGroup,
  removeFolder,
  startProcess,
  startVirtualDisplay,
  type VirtualDisplay,
} from "./processes";

/** Key of a reference to an element (W3C WebDriver, 12.1). */
const ELEMENT_KEY = "element-6066-11e4-a52e-4f735466cecf";

/**
 * Time limit of the start of a browser, in milliseconds, and how often it is tried. The driver chooses a port that is
 * free, and waits without end for the browser if another process takes the port before it does.
 */
const START_TIMEOUT_MS = 60_000;
const START_ATTEMPTS = 3;

/** Send a command and return the value of its response. */
async function send<Value>(
  method: string,
  url: string,
  parameters: Record<string, unknown> = {},
  timeoutMs = COMMAND_TIMEOUT_MS,
): Promise<Value> {
  const response = await fetch(url, {
    method,
    body: method === "POST" ? JSON.stringify(parameters) : null,
    signal: AbortSignal.timeout(timeoutMs),
  });
  const { value } = (await response.json()) as { value: Value & { error?: string; message?: string } };
  if (!response.ok) throw new Error(`${method} ${new URL(url).pathname}: ${value.error}: ${value.message}`);
  return value;
}

export async function startWebKit(program: string): Promise<Browser> {
  const folder = mkdtempSync(join(tmpdir(), "bunraku-webkit-"));
  const downloads = join(folder, "Downloads");
  for (const path of [downloads, join(folder, ".config/gtk-3.0")]) mkdirSync(path, { recursive: true });
  writeFileSync(join(folder, ".config/user-dirs.dirs"), 'XDG_DOWNLOAD_DIR="$HOME/Downloads"\n');
  // The page prefers reduced motion.
  writeFileSync(join(folder, ".config/gtk-3.0/settings.ini"), "[Settings]\ngtk-enable-animations=0\n");
  return new WebKit(program, await startVirtualDisplay(), folder, downloads);
}

/** Wait until the driver accepts commands. */
async function waitForDriver(driver: ChildProcess, url: string): Promise<void> {
  const deadline = Date.now() + START_TIMEOUT_MS;
  while (driver.exitCode === null) {
    const isReady = await send("GET", `${url}/status`).then(
      () => true,
      () => false,
    );
    if (isReady) return;
    if (Date.now() > deadline) break;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  throw new Error(`WebKitWebDriver does not answer at ${url} (exit code ${driver.exitCode})`);
}

/** Each session has a driver and a browser of its own, whose windows are private. */
class WebKit implements Browser {
  constructor(
    private readonly program: string,
    private readonly display: VirtualDisplay,
    private readonly folder: string,
    private readonly downloads: string,
  ) {}

  async openSession(options: SessionOptions = {}): Promise<BrowserSession> {
    for (let attempt = 1; ; attempt++) {
      const url = `http://127.0.0.1:${await findFreePort()}`;
      const driver = this.#startDriver(url);
      try {
        await waitForDriver(driver, url);
        return await this.#startBrowser(driver, url, options);
      } catch (error) {
        await killProcessGroup(driver);
        if (attempt === START_ATTEMPTS) throw error;
        console.warn(`WebKitGTK did not start, it is tried again: ${error}`);
      }
    }
  }

  #startDriver(url: string): ChildProcess {
    const environment = {
      DISPLAY: this.display.name,
      HOME: this.folder,
      XDG_CONFIG_HOME: join(this.folder, ".config"),
    };
    const driver = startProcess(this.program, [`--port=${new URL(url).port}`], environment, { isGroup: true });
    for (const output of [driver.stdout, driver.stderr]) output?.resume();
    return driver;
  }

  async #startBrowser(driver: ChildProcess, driverUrl: string, { hasStorage = true }: SessionOptions) {
    const storage = ["--enable-html5-local-storage=false", "--enable-html5-database=false"];
    const args = ["--automation", ...(hasStorage ? [] : storage)];
    const { sessionId } = await send<{ sessionId: string }>(
      "POST",
      `${driverUrl}/session`,
      { capabilities: { alwaysMatch: { "webkitgtk:browserOptions": { args } } } },
      START_TIMEOUT_MS,
    );
    const url = `${driverUrl}/session/${sessionId}`;
    await send("POST", `${url}/timeouts`, { script: COMMAND_TIMEOUT_MS, pageLoad: COMMAND_TIMEOUT_MS });
    let isFirst = true;
    return {
      errors: [],
      downloads: this.downloads,
      async open(address: string, size?: WindowSize) {
        const handle = isFirst
          ? await send<string>("GET", `${url}/window`)
          : (await send<{ handle: string }>("POST", `${url}/window/new`, { type: "window" })).handle;
        isFirst = false;
        const window = new WebKitWindow(url, handle);
        if (size) await window.resize(size);
        await window.goto(address);
        return window;
      },
      close: () => killProcessGroup(driver),
    };
  }

  async close(): Promise<void> {
    await this.display.stop();
    removeFolder(this.folder);
  }
}

/**
 * In the page: dispatch the events of touches. WebKitWebDriver 2.50 accepts the actions of a touch but never answers.
 */
function dispatchTouches(json: string): void {
  const place = ((globalThis as { lastTouch?: { x: number; y: number; target: Element | null } }).lastTouch ??= {
    x: 0,
    y: 0,
    target: null,
  });
  for (const action of JSON.parse(json) as PointerAction[]) {
    if (action.type === "pointerMove") Object.assign(place, { x: action.x, y: action.y });
    if (action.type === "pointerDown") place.target = document.elementFromPoint(place.x, place.y);
    place.target?.dispatchEvent(
      new PointerEvent(action.type.toLowerCase(), {
        pointerType: "touch",
        // The mouse's, since an element can only capture a pointer that exists.
        pointerId: 1,
        isPrimary: true,
        button: action.type === "pointerMove" ? -1 : 0,
        buttons: action.type === "pointerUp" ? 0 : 1,
        clientX: place.x,
        clientY: place.y,
        bubbles: true,
        cancelable: true,
        composed: true,
      }),
    );
    if (action.type === "pointerUp") place.target = null;
  }
}

class WebKitWindow implements BrowserWindow {
  constructor(
    private readonly session: string,
    private readonly handle: string,
  ) {}

  async resize(size: WindowSize): Promise<void> {
    await this.#send("/window/rect", { ...size });
  }

  async goto(url: string): Promise<void> {
    await this.#send("/url", { url });
  }

  call(declaration: string, argument: string): Promise<string> {
    return this.#send("/execute/sync", { script: `return (${declaration})(arguments[0])`, args: [argument] });
  }

  async perform(...devices: InputDevice[]): Promise<void> {
    const touches = devices.flatMap((device) =>
      device.type === "pointer" && device.parameters.pointerType === "touch" ? device.actions : [],
    );
    if (touches.length > 0) await this.call(String(dispatchTouches), JSON.stringify(touches));
    else await this.#send("/actions", { actions: devices });
  }

  async chooseFile(selector: string, path: string): Promise<void> {
    const element = await this.#send<Record<string, string>>("/element", { using: "css selector", value: selector });
    await this.#send(`/element/${element[ELEMENT_KEY]}/value`, { text: path });
  }

  async screenshot(): Promise<string> {
    await this.#select();
    return send("GET", `${this.session}/screenshot`);
  }

  async close(): Promise<void> {
    await this.#select();
    await send("DELETE", `${this.session}/window`);
  }

  async #send<Value>(command: string, parameters: Record<string, unknown>): Promise<Value> {
    await this.#select();
    return send("POST", this.session + command, parameters);
  }

  /** Commands apply to the selected window of the session. */
  async #select(): Promise<void> {
    await send("POST", `${this.session}/window`, { handle: this.handle });
  }
}
