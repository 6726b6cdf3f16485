/** Draws the pictures of the film in a browser: `globalThis.film`. */
import { WebGLRenderer } from "three";
import { performancePose } from "./performance";
import { type CameraView, createCamera, createRoom, Person } from "./person";

export const [FILM_WIDTH, FILM_HEIGHT] = [640, 480];
/** Bits of the number of a picture, drawn as squares in its upper left corner, the lowest first. */
export const NUMBER_BITS = 10;
export const SQUARE_PX = 16;

export interface Film {
  /** Return the picture after `seconds` of the performance as JPEG, in base64, with its number in a corner. */
  draw(seconds: number, number: number, view: CameraView): string;
}

declare global {
  var film: Film;
}

const person = new Person();
const room = createRoom(person);
const canvas = document.createElement("canvas");
const renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
renderer.setSize(FILM_WIDTH, FILM_HEIGHT, false);
const print = document.createElement("canvas");
[print.width, print.height] = [FILM_WIDTH, FILM_HEIGHT];
const context = print.getContext("2d") as CanvasRenderingContext2D;

globalThis.film = {
  draw(seconds, number, view) {
    person.apply(performancePose(seconds));
    renderer.render(room, createCamera(view, FILM_WIDTH / FILM_HEIGHT));
    context.drawImage(canvas, 0, 0);
    for (let bit = 0; bit < NUMBER_BITS; bit++) {
      context.fillStyle = (number >> bit) & 1 ? "#fff" : "#000";
      context.fillRect(bit * SQUARE_PX, 0, SQUARE_PX, SQUARE_PX);
    }
    return print.toDataURL("image/jpeg", 0.9).split(",")[1];
  },
};
