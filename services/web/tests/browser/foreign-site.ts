/** Another site: plain HTML files, served from an origin of their own. */
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";

export interface ForeignSite {
  /** `http://127.0.0.1:PORT`. */
  readonly origin: string;
  /** The same files under another name, which is another origin. */
  readonly alias: string;
  /** What stands at the site's only address. */
  html: string;
  stop(): void;
}

export async function startForeignSite(): Promise<ForeignSite> {
  const server = createServer((_, answer) =>
    answer.writeHead(200, { "Content-Type": "text/html; charset=utf-8" }).end(site.html),
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
