import { expect, test, vi } from "vitest";
import type { LimbSolver } from "../../src/client/solver";
import { SolverLoader } from "../../src/client/solver-loader";
import { goldenTrack } from "../golden-motion";

const { figure } = goldenTrack();
const settled = () => new Promise((done) => setTimeout(done));

test("it is made once, and is there when it is made", async () => {
  let made: (solver: LimbSolver) => void = () => undefined;
  const maker = vi.fn(() => new Promise<LimbSolver>((done) => (made = done)));
  const own = new SolverLoader(figure, "http://stage", maker);
  await settled();
  expect(maker).not.toHaveBeenCalled();
  own.load();
  own.load();
  await settled();
  own.load();
  expect(own.solver).toBeNull();
  const solver = {} as LimbSolver;
  made(solver);
  await settled();
  own.load();
  await settled();
  expect(maker.mock.calls).toEqual([[figure, "http://stage"]]);
  expect(own.solver).toBe(solver);
});

test("one that could not be made is tried again, and told", async () => {
  const warned = vi.spyOn(console, "warn").mockReturnValue();
  const made = vi
    .fn<() => Promise<LimbSolver>>()
    .mockRejectedValueOnce(new Error("no line"))
    .mockResolvedValue({} as LimbSolver);
  const own = new SolverLoader(figure, "http://stage", made);
  own.load();
  await settled();
  expect([own.solver, warned.mock.calls.length]).toEqual([null, 1]);
  own.load();
  await settled();
  expect(own.solver).not.toBeNull();
  warned.mockRestore();
});

test("with none wanted there is none", async () => {
  const own = new SolverLoader(figure, "http://stage", null);
  own.load();
  await settled();
  expect(own.solver).toBeNull();
});
