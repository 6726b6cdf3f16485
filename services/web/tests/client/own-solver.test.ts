import { expect, test, vi } from "vitest";
import { OwnSolver } from "../../src/client/own-solver";
import type { Solver } from "../../src/client/solver";
import { goldenTrack } from "../golden";

const [one, other] = [goldenTrack(0).figure, goldenTrack(1).figure];
const settled = () => new Promise((done) => setTimeout(done));

test("a figure's is made once, and is there when it is made", async () => {
  const made = vi.fn(async () => ({}) as Solver);
  const own = new OwnSolver("http://stage", made);
  own.prepare(null);
  own.prepare(one);
  expect(own.solver).toBeNull();
  await settled();
  const { solver } = own;
  expect(solver).not.toBeNull();
  own.prepare(one);
  await settled();
  expect(made.mock.calls).toEqual([[one, "http://stage"]]);
  expect(own.solver).toBe(solver);
});

test("of two figures the later one's counts, whichever was made first", async () => {
  const makers: ((solver: Solver) => void)[] = [];
  const own = new OwnSolver("http://stage", () => new Promise((done) => makers.push(done)));
  own.prepare(one);
  own.prepare(other);
  await settled();
  const [first, second] = [{} as Solver, {} as Solver];
  makers[1](second);
  makers[0](first);
  await settled();
  expect(own.solver).toBe(second);
});

test("one that could not be made is tried again, and told", async () => {
  const warned = vi.spyOn(console, "warn").mockReturnValue();
  const made = vi.fn<() => Promise<Solver>>().mockRejectedValueOnce(new Error("no line")).mockResolvedValue({} as Solver);
  const own = new OwnSolver("http://stage", made);
  own.prepare(one);
  await settled();
  expect([own.solver, warned.mock.calls.length]).toEqual([null, 1]);
  own.prepare(one);
  await settled();
  expect(own.solver).not.toBeNull();
  warned.mockRestore();
});

test("with none wanted there is none", async () => {
  const own = new OwnSolver("http://stage", null);
  own.prepare(one);
  await settled();
  expect(own.solver).toBeNull();
});
