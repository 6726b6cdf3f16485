/** A web site on another origin than the server's. It stores pages (PUT) and shows them (GET). */
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { text } from "node:stream/consumers";

export interface ForeignSite {
  /** `http://127.0.0.1:PORT`. */
  readonly origin: string;
  /** Second origin of the same site: the same server under another host name. */
  readonly alias: string;
}

export async function startForeignSite(): Promise<ForeignSite & { stop(): void }> {
  const pages = new Map<string, string>();
  const server = createServer(async (request, response) => {
    const path = request.url ?? "/";
    if (request.method === "PUT") {
      pages.set(path, await text(request));
      response.writeHead(204).end();
      return;
    }
    const page = pages.get(path);
    response.writeHead(page === undefined ? 404 : 200, { "Content-Type": "text/html; charset=utf-8" }).end(page);
  });
  await new Promise<void>((done) => server.listen(0, done));
  const { port } = server.address() as AddressInfo;
  return {
    origin: `http://127.0.0.1:${port}`,
    alias: `http://localhost:${port}`,
    stop() {
      server.closeAllConnections();
      server.close();
    },
  };
}
