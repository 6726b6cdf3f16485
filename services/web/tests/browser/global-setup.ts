/**
 * Set-up of a run of browser tests: a folder for the encoded demo, filled by the first test that needs it
 * (`server.ts`).
 */
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

export default function setup(): () => void {
  const folder = mkdtempSync(join(tmpdir(), "bunraku-browser-demo-"));
  process.env["BUNRAKU_DEMO_DATA"] = folder;
  return () => rmSync(folder, { recursive: true, force: true });
}
