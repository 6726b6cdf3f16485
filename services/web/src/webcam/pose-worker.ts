/** Worker that loads the pose detector and detects the person in the pictures that it receives, one at a time. */
import { loadModelFiles } from "./model-files";
import { PoseDetector } from "./pose-detector";
import type { PictureMessage, WorkerMessage } from "./worker-message";

const send = (message: WorkerMessage) => self.postMessage(message);

async function start(): Promise<void> {
  const files = await loadModelFiles((share) => send({ type: "progress", share }));
  const detector = await PoseDetector.create(files);
  self.addEventListener("message", ({ data: { picture, now } }: MessageEvent<PictureMessage>) => {
    try {
      send({ type: "body", body: detector.detect(picture, now), now });
    } catch (error) {
      fail(error);
    } finally {
      picture.close();
    }
  });
  send({ type: "ready" });
}

function fail(error: unknown): void {
  send({ type: "failed", message: String(error) });
}

start().catch(fail);
