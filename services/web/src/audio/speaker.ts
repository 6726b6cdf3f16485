/** The audio device: volume and autoplay state. */

export const FRAMES_PER_SECOND = 48_000;

/** Time constant of volume changes, in seconds. */
const VOLUME_TIME_CONSTANT_S = 0.015;

export class Speaker {
  readonly context = new AudioContext({ sampleRate: FRAMES_PER_SECOND, latencyHint: "interactive" });
  readonly output: GainNode = this.context.createGain();

  /** `onChange` is called when playback becomes possible or impossible. */
  constructor(onChange: () => void) {
    this.output.gain.value = 0;
    this.output.connect(this.context.destination);
    this.context.addEventListener("statechange", onChange);
  }

  get heard(): boolean {
    return this.context.state === "running";
  }

  /** Start playback if the browser allows it: most require a user gesture first. */
  resume(): void {
    void this.context.resume();
  }

  suspend(): void {
    void this.context.suspend();
  }

  /** Close the device permanently. */
  close(): void {
    void this.context.close();
  }

  /** Perceived volume, 0 to 1; loudness is about the square root of the amplitude. */
  set volume(volume: number) {
    this.output.gain.setTargetAtTime(volume ** 2, this.context.currentTime, VOLUME_TIME_CONSTANT_S);
  }
}
