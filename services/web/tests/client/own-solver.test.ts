import { expect, test, vi } from "vitest";
import { OwnSolver } from "../../src/client/own-solver";
import type { Solver } from "../../src/client/solver";
import { goldenTrack } from "../golden";

const { figure } = goldenTrack();
const settled = () => new Promise((done) => setTimeout(done));

test("it is made once, and is there when it is made", async () => {
  let made: (solver: Solver) => void = () => undefined;
  const maker = vi.fn(() => new Promise<Solver>((done) => (made = done)));
  const own = new OwnSolver(figure, "http://stage", maker);
  await settled();
  expect(maker).not.toHaveBeenCalled();
  own.prepare();
  own.prepare();
  await settled();
  own.prepare();
  expect(own.solver).toBeNull();
  const solver = {} as Solver;
  made(solver);
  await settled();
  own.prepare();
  await settled();
  expect(maker.mock.calls).toEqual([[figure, "http://stage"]]);
  expect(own.solver).toBe(solver);
});

test("one that could not be made is tried again, and told", async () => {
  const warned = vi.spyOn(console, "warn").mockReturnValue();
  const made = vi.fn<() => Promise<Solver>>().mockRejectedValueOnce(new Error("no line")).mockResolvedValue({} as Solver);
  const own = new OwnSolver(figure, "http://stage", made);
  own.prepare();
  await settled();
  expect([own.solver, warned.mock.calls.length]).toEqual([null, 1]);
  own.prepare();
  await settled();
  expect(own.solver).not.toBeNull();
  warned.mockRestore();
});

test("with none wanted there is none", async () => {
  const own = new OwnSolver(figure, "http://stage", null);
  own.prepare();
  await settled();
  expect(own.solver).toBeNull();
});
