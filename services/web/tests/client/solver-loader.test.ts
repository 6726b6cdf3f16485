import { expect, test, vi } from "vitest";
import type { LimbSolver } from "../../src/client/marionette-solver";
import { SolverLoader } from "../../src/client/solver-loader";
import { goldenTrack } from "../golden-motion";

const { figure } = goldenTrack();
const settle = () => new Promise((done) => setTimeout(done));

test("solver is created once", async () => {
  let resolve: (solver: LimbSolver) => void = () => undefined;
  const factory = vi.fn(() => new Promise<LimbSolver>((done) => (resolve = done)));
  const loader = new SolverLoader(figure, "http://stage", factory);
  await settle();
  expect(factory).not.toHaveBeenCalled();
  loader.load();
  loader.load();
  await settle();
  loader.load();
  expect(loader.solver).toBeNull();
  const solver = {} as LimbSolver;
  resolve(solver);
  await settle();
  loader.load();
  await settle();
  expect(factory.mock.calls).toEqual([[figure, "http://stage"]]);
  expect(loader.solver).toBe(solver);
});

test("failure is logged, and the next load tries again", async () => {
  const warn = vi.spyOn(console, "warn").mockReturnValue();
  const factory = vi
    .fn<() => Promise<LimbSolver>>()
    .mockRejectedValueOnce(new Error("unreachable"))
    .mockResolvedValue({} as LimbSolver);
  const loader = new SolverLoader(figure, "http://stage", factory);
  loader.load();
  await settle();
  expect([loader.solver, warn.mock.calls.length]).toEqual([null, 1]);
  loader.load();
  await settle();
  expect(loader.solver).not.toBeNull();
  warn.mockRestore();
});

test("null factory loads nothing", async () => {
  const loader = new SolverLoader(figure, "http://stage", null);
  loader.load();
  await settle();
  expect(loader.solver).toBeNull();
});
