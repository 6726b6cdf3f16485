/**
 * TCP proxy in front of a server, with which a test delays or cuts connections. Playwright's WebSocket routes do not
 * reach the WebSockets of a worker.
 */
import { type AddressInfo, connect, createServer, type Socket } from "node:net";

export interface ConnectionProxy {
  /** Base URL, without a trailing slash. */
  readonly url: string;
  /** Number of WebSocket connections to the server that were opened so far. */
  readonly webSocketCount: number;
  /** Cut all connections and refuse new ones, or accept them again. */
  setOffline(offline: boolean): void;
  /** Cut the open WebSocket connections whose path matches. */
  cutWebSockets(path: RegExp): void;
  stop(): void;
}

/** Start of a WebSocket's handshake (RFC 6455, section 4.1). */
const HANDSHAKE = /^GET (\S+) .*?\r\nUpgrade: websocket\r\n/is;

/** Start a proxy of the server at `target`. All bytes of WebSockets are delayed by up to `maxDelayMs`, in order. */
export async function startProxy(target: string, maxDelayMs = 0): Promise<ConnectionProxy> {
  const { hostname, port } = new URL(target);
  const sockets = new Set<Socket>();
  /** Paths of the open WebSockets. */
  const webSockets = new Map<Socket, string>();
  let webSocketCount = 0;
  let isOffline = false;
  const server = createServer((client) => {
    if (isOffline) {
      client.destroy();
      return;
    }
    const upstream = connect(Number(port), hostname);
    for (const [socket, other] of [
      [client, upstream],
      [upstream, client],
    ]) {
      sockets.add(socket);
      socket.setNoDelay();
      // A cut connection is an error on its other side; the close follows.
      socket.on("error", () => undefined);
      socket.on("close", () => {
        sockets.delete(socket);
        webSockets.delete(socket);
        other.destroySoon();
      });
    }
    client.once("data", (head) => {
      const path = HANDSHAKE.exec(head.toString("latin1"))?.[1];
      if (path !== undefined) {
        webSockets.set(client, path);
        webSocketCount++;
      }
      upstream.write(head);
      const delayMs = path === undefined ? 0 : maxDelayMs;
      forward(client, upstream, delayMs);
      forward(upstream, client, delayMs);
    });
  });
  await new Promise<void>((done) => server.listen(0, "127.0.0.1", done));
  const cutAll = () => {
    for (const socket of sockets) socket.destroy();
  };
  return {
    url: `http://127.0.0.1:${(server.address() as AddressInfo).port}`,
    get webSocketCount() {
      return webSocketCount;
    },
    setOffline(offline) {
      isOffline = offline;
      if (offline) cutAll();
    },
    cutWebSockets(path) {
      for (const [socket, opened] of webSockets) if (path.test(opened)) socket.destroy();
    },
    stop() {
      server.close();
      cutAll();
    },
  };
}

/** Forward data from one socket to another, each chunk delayed by up to `maxDelayMs`, in order. */
function forward(from: Socket, to: Socket, maxDelayMs: number): void {
  if (maxDelayMs === 0) {
    from.pipe(to);
    return;
  }
  let dueMs = 0;
  from.on("data", (chunk) => {
    dueMs = Math.max(dueMs, performance.now() + Math.random() * maxDelayMs);
    setTimeout(() => to.write(chunk), dueMs - performance.now());
  });
}
