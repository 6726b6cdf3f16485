/** A web site on another origin, which serves one HTML page. */
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";

export interface ForeignSite {
  /** `http://127.0.0.1:PORT`. */
  readonly origin: string;
  /** Second origin of the same site: the same server under another host name. */
  readonly alias: string;
  /** HTML of the page, served at every path. */
  html: string;
  stop(): void;
}

export async function startForeignSite(): Promise<ForeignSite> {
  const server = createServer((_, response) =>
    response.writeHead(200, { "Content-Type": "text/html; charset=utf-8" }).end(site.html),
  );
  await new Promise<void>((done) => server.listen(0, done));
  const { port } = server.address() as AddressInfo;
  const site: ForeignSite = {
    origin: `http://127.0.0.1:${port}`,
    alias: `http://localhost:${port}`,
    html: "",
    stop() {
      server.closeAllConnections();
      server.close();
    },
  };
  return site;
}
