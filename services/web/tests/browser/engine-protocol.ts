/** DevTools protocol of the threads of a page: its main thread, and the engine's worker if there is one. */
import type { CDPSession, Page } from "playwright-core";
import { engineOf } from "./engine-probe";

/** Connection to one thread, with the methods and events of `CDPSession`. */
export type ThreadProtocol = Pick<CDPSession, "send" | "on" | "off">;

interface Reply {
  id: number;
  result?: object;
  error?: { message: string };
}

/** Return connections to the threads of a page, the main thread first, once the page has an engine. */
export async function openThreadProtocols(page: Page): Promise<ThreadProtocol[]> {
  const main = await page.context().newCDPSession(page);
  const engine = await engineOf(page);
  return engine === page ? [main] : [main, await connectToWorker(main, engine.url())];
}

/** Collect garbage several times: finalizers make further objects unreachable. */
export async function collectGarbage(threads: readonly ThreadProtocol[]): Promise<void> {
  for (const thread of threads) {
    await thread.send("HeapProfiler.enable");
    for (let nth = 0; nth < 3; nth++) await thread.send("HeapProfiler.collectGarbage");
  }
}

/** Connect to the page's worker with this URL. Playwright has no sessions of workers: its messages are wrapped. */
async function connectToWorker(main: CDPSession, url: string): Promise<ThreadProtocol> {
  const attached = new Promise<string>((resolve) =>
    main.on("Target.attachedToTarget", ({ sessionId, targetInfo }) => targetInfo.url === url && resolve(sessionId)),
  );
  await main.send("Target.setAutoAttach", { autoAttach: true, waitForDebuggerOnStart: false, flatten: false });
  const sessionId = await attached;
  const pending = new Map<number, (reply: Reply) => void>();
  const listeners = new Map<string, Set<(params: never) => void>>();
  main.on("Target.receivedMessageFromTarget", (received) => {
    if (received.sessionId !== sessionId) return;
    const message = JSON.parse(received.message) as Reply | { method: string; params: never };
    if ("method" in message) {
      for (const listener of listeners.get(message.method) ?? []) listener(message.params);
      return;
    }
    pending.get(message.id)?.(message);
    pending.delete(message.id);
  });
  let lastId = 0;
  const protocol = {
    async send(method: string, params: object = {}) {
      const id = ++lastId;
      const reply = new Promise<Reply>((resolve) => pending.set(id, resolve));
      await main.send("Target.sendMessageToTarget", { sessionId, message: JSON.stringify({ id, method, params }) });
      const { result, error } = await reply;
      if (error) throw new Error(`${method}: ${error.message}`);
      return result;
    },
    on(event: string, listener: (params: never) => void) {
      listeners.set(event, (listeners.get(event) ?? new Set()).add(listener));
    },
    off: (event: string, listener: (params: never) => void) => void listeners.get(event)?.delete(listener),
  };
  return protocol as unknown as ThreadProtocol;
}
