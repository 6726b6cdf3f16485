/** Film of the person for Chromium's fake camera, as YUV4MPEG2, which it plays in a loop. */
import { closeSync, openSync, writeSync } from "node:fs";
import { PerspectiveCamera } from "three";
import { performancePose } from "./performance";
import { Person } from "./person";
import { drawPicture, type Picture } from "./rasteriser";

export const [FILM_WIDTH, FILM_HEIGHT] = [640, 480];
export const FILM_FPS = 30;
/** Bits of the number of a picture, drawn as squares in its upper left corner, the lowest first. */
export const NUMBER_BITS = 10;
export const SQUARE_PX = 16;

export interface CameraView {
  /** Distance of the camera from the person, and its height, in metres. */
  readonly distance: number;
  readonly height: number;
  /** Vertical field of view in degrees: a laptop's camera has about 45. */
  readonly fov: number;
}

export interface FilmOptions {
  /** Time of the performance that each picture shows, in seconds. A repeated picture is drawn once. */
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

/** Write the film to `path`, whose name must end in `.y4m`. Each picture contains its number. */
export function writeFilm(path: string, { times, view }: FilmOptions): void {
  const person = new Person();
  const camera = new PerspectiveCamera(view.fov, FILM_WIDTH / FILM_HEIGHT, 0.05, 20);
  camera.position.set(0, view.height, view.distance);
  const file = openSync(path, "w");
  try {
    writeSync(file, `YUV4MPEG2 W${FILM_WIDTH} H${FILM_HEIGHT} F${FILM_FPS}:1 Ip A1:1 C420jpeg\n`);
    let frame: Uint8Array | null = null;
    times.forEach((time, number) => {
      if (!frame || time !== times[number - 1]) {
        person.apply(performancePose(time));
        const picture = drawPicture(person.group, camera, FILM_WIDTH, FILM_HEIGHT);
        drawNumber(picture, number);
        frame = toYuv420(picture);
      }
      writeSync(file, "FRAME\n");
      writeSync(file, frame);
    });
  } finally {
    closeSync(file);
  }
}

function drawNumber({ width, pixels }: Picture, number: number): void {
  for (let bit = 0; bit < NUMBER_BITS; bit++)
    for (let y = 0; y < SQUARE_PX; y++) {
      const at = (y * width + bit * SQUARE_PX) * 3;
      pixels.fill((number >> bit) & 1 ? 255 : 0, at, at + SQUARE_PX * 3);
    }
}

/** Convert to planes of luma and of halved chroma, in studio range (ITU-R BT.601). */
function toYuv420({ width, height, pixels }: Picture): Uint8Array {
  const size = width * height;
  const planes = new Uint8Array(size * 1.5);
  for (let pixel = 0; pixel < size; pixel++) {
    const [red, green, blue] = [pixels[pixel * 3], pixels[pixel * 3 + 1], pixels[pixel * 3 + 2]];
    planes[pixel] = 16 + 0.257 * red + 0.504 * green + 0.098 * blue;
    const [x, y] = [pixel % width, Math.floor(pixel / width)];
    if (x % 2 || y % 2) continue;
    const chroma = size + (y / 2) * (width / 2) + x / 2;
    planes[chroma] = 128 - 0.148 * red - 0.291 * green + 0.439 * blue;
    planes[chroma + size / 4] = 128 + 0.439 * red - 0.368 * green - 0.071 * blue;
  }
  return planes;
}
