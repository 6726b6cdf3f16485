/** Reporter that lists the slowest tests at the end of a run, like `--durations` of pytest. */
import type { Reporter, TestModule } from "vitest/node";

const COUNT = 20;

export default class SlowestTests implements Reporter {
  onTestRunEnd(modules: readonly TestModule[]): void {
    const tests = modules.flatMap(({ children, relativeModuleId }) =>
      [...children.allTests()].map((test) => ({
        name: `${relativeModuleId} > ${test.fullName}`,
        seconds: (test.diagnostic()?.duration ?? 0) / 1000,
      })),
    );
    if (tests.length <= COUNT) return;
    const slowest = tests.sort((a, b) => b.seconds - a.seconds).slice(0, COUNT);
    const lines = slowest.map(({ name, seconds }) => `${seconds.toFixed(2).padStart(7)} s  ${name}`);
    console.log([`\nslowest ${COUNT} tests:`, ...lines, ""].join("\n"));
  }
}
