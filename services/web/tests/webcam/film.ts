/** Film of the person for Chromium's fake camera: Motion JPEG, which it plays at 30 pictures per second, in a loop. */
import { createWriteStream } from "node:fs";
import { resolve } from "node:path";
import { finished } from "node:stream/promises";
import type { Browser } from "playwright-core";
import { build, type Rolldown } from "vite";
import type { CameraView } from "./person";

export const FILM_FPS = 30;

export interface FilmOptions {
  /**
   * Time of the performance that each picture shows, in seconds. Successive pictures of the same time are one picture,
   * which is drawn once.
   */
  readonly times: readonly number[];
  readonly view: CameraView;
}

/** Switches of Chromium that show the film to a page which asks for a camera. */
export function fakeCamera(path: string): string[] {
  return [
    "--use-fake-device-for-media-stream",
    "--use-fake-ui-for-media-stream",
    `--use-file-for-fake-video-capture=${path}`,
  ];
}

/**
 * Draw the film in a browser and write it to `path`. Each picture contains its number, counted without repetitions.
 * Return the times of the pictures by their numbers.
 */
export async function writeFilm(browser: Browser, path: string, { times, view }: FilmOptions): Promise<number[]> {
  const page = await browser.newPage();
  const drawn: number[] = [];
  try {
    await page.addScriptTag({ content: await bundleFilmPage() });
    const file = createWriteStream(path);
    let picture = "";
    for (const time of times) {
      if (time !== drawn.at(-1)) {
        drawn.push(time);
        picture = await page.evaluate(([seconds, number, camera]) => globalThis.film.draw(seconds, number, camera), [
          time,
          drawn.length - 1,
          view,
        ] as const);
      }
      file.write(Buffer.from(picture, "base64"));
    }
    file.end();
    await finished(file);
  } finally {
    await page.close();
  }
  return drawn;
}

async function bundleFilmPage(): Promise<string> {
  const result = await build({
    configFile: false,
    logLevel: "error",
    build: {
      write: false,
      lib: { entry: resolve(import.meta.dirname, "film-page.ts"), formats: ["iife"], name: "filmPage" },
    },
  });
  const [{ output }] = [result].flat() as Rolldown.RolldownOutput[];
  return output[0].code;
}
