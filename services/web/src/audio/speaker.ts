/** One audio device: how loud, and whether it may be heard yet. */

export const FRAMES_PER_SECOND = 48_000;

/** Time constant of changes of loudness, seconds. */
const VOLUME_TIME_CONSTANT_S = 0.015;

export class Speaker {
  readonly context = new AudioContext({ sampleRate: FRAMES_PER_SECOND, latencyHint: "interactive" });
  readonly output: GainNode = this.context.createGain();

  /** `changed` is told when it begins or ends to be heard. */
  constructor(changed: () => void) {
    this.output.gain.value = 0;
    this.output.connect(this.context.destination);
    this.context.addEventListener("statechange", changed);
  }

  get heard(): boolean {
    return this.context.state === "running";
  }

  /** Is heard from now on, where the browser lets it: most want a gesture of the person before. */
  resume(): void {
    void this.context.resume();
  }

  suspend(): void {
    void this.context.suspend();
  }

  /** Gives the device back, for good. */
  close(): void {
    void this.context.close();
  }

  /** How loud, 0 to 1 as it is heard; loudness goes with about the square root of the amplitude. */
  set volume(volume: number) {
    this.output.gain.setTargetAtTime(volume ** 2, this.context.currentTime, VOLUME_TIME_CONSTANT_S);
  }
}
