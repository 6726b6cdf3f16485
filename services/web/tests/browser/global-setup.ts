/** What the browser tests of one run share: a folder for our own dance, made by the first that needs it (`server.ts`). */
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

export default function setup(): () => void {
  const folder = mkdtempSync(join(tmpdir(), "bunraku-browser-demo-"));
  process.env["BUNRAKU_DEMO_DATA"] = folder;
  return () => rmSync(folder, { recursive: true, force: true });
}
