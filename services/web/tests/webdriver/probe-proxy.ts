/**
 * HTTP proxy before a server that adds a script to each page and its worker, before their own. WebDriver has no way to
 * do this, and no access to the console.
 */
import { createServer, request as sendRequest } from "node:http";
import { type AddressInfo, connect } from "node:net";
import { text } from "node:stream/consumers";

/** Path of the script of the pages. */
const PROBE_PATH = "/probe-of-tests.js";
/** Script of the page's worker, which the page runs too. */
const WORKER_PATH = /\/assets\/main-[\w-]+\.js$/;

/** Scripts that run before those of pages, and before those of their workers. */
export interface Probes {
  readonly page: string;
  readonly worker: string;
}

export interface ProbeProxy {
  /** Base URL, without a trailing slash. */
  readonly url: string;
  stop(): Promise<void>;
}

/** Start a proxy of the server at `target`, whose pages and workers run the present probes first. */
export async function startProbeProxy(target: string, getProbes: () => Probes): Promise<ProbeProxy> {
  const { hostname, port } = new URL(target);
  const proxy = createServer((request, response) => {
    if (request.url === PROBE_PATH) {
      response.writeHead(200, { "Content-Type": "text/javascript", "Cache-Control": "no-store" }).end(getProbes().page);
      return;
    }
    const { "accept-encoding": _, ...headers } = request.headers;
    const { method, url: path } = request;
    const forwarded = sendRequest({ hostname, port, method, path, headers }, async (answer) => {
      const { statusCode = 502, headers } = answer;
      const isPage = headers["content-type"]?.startsWith("text/html");
      if (!isPage && !WORKER_PATH.test(path ?? "")) {
        answer.pipe(response.writeHead(statusCode, headers));
        return;
      }
      const { "content-length": _, ...others } = headers;
      const content = await text(answer);
      response
        .writeHead(statusCode, others)
        .end(
          isPage
            ? content.replace("<head>", `$&<script src="${PROBE_PATH}"></script>`)
            : `if (!("document" in globalThis)) {\n${getProbes().worker}\n}\n${content}`,
        );
    });
    forwarded.on("error", () => response.destroy());
    response.on("close", () => forwarded.destroy());
    request.pipe(forwarded);
  });
  proxy.on("upgrade", ({ method, url: path, rawHeaders }, client, head) => {
    const server = connect(Number(port), hostname);
    const lines = Array.from(
      { length: rawHeaders.length / 2 },
      (_, i) => `${rawHeaders[2 * i]}: ${rawHeaders[2 * i + 1]}`,
    );
    server.write([`${method} ${path} HTTP/1.1`, ...lines, "", ""].join("\r\n"));
    server.write(head);
    for (const [from, to] of [
      [client, server],
      [server, client],
    ] as const)
      from.pipe(to).on("error", () => from.destroy());
  });
  await new Promise<void>((done) => proxy.listen(0, "127.0.0.1", done));
  return {
    url: `http://127.0.0.1:${(proxy.address() as AddressInfo).port}`,
    async stop() {
      const closed = new Promise((done) => proxy.close(done));
      proxy.closeAllConnections();
      await closed;
    },
  };
}
