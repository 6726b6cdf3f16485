import { Access, Stage, tabToken, Viewer } from "/embed/bunraku.js";

const canvas = document.querySelector("#own-camera");
const access = new Access(location.origin, tabToken());
const { items } = await (await access.request("/v1/sessions")).json();

const stage = new Stage(canvas);
stage.setTheme("night");
const fit = () => stage.resize(canvas.clientWidth, canvas.clientHeight, "alone", devicePixelRatio);
new ResizeObserver(fit).observe(canvas);

const url = `${location.origin.replace("http", "ws")}/v1/sessions/${items[0].id}/stream`;
const viewer = new Viewer({ url, access });
// of several performers the further ones may be known a little later
const enter = () => stage.setFigures(viewer.performers.map((one) => one?.figure ?? viewer.figure), viewer.front);
for (const news of ["figure", "tracks"]) viewer.addEventListener(news, enter);

const calm = matchMedia("(prefers-reduced-motion: reduce)");
let before = performance.now();
requestAnimationFrame(function frame(now) {
  requestAnimationFrame(frame);
  // once around in forty seconds
  const way = calm.matches ? 0 : (now / 40_000) * 2 * Math.PI;
  // where the camera stands, what it looks at (metres), and how wide it sees (radians)
  const camera = [4.5 * Math.sin(way), 1.3, 4.5 * Math.cos(way), 0, 1, 0, 0.55];
  const poses = viewer.performers.map((_, performer) => viewer.poseAt(now, performer));
  stage.draw(poses, undefined, (now - before) / 1000, camera);
  before = now;
});
