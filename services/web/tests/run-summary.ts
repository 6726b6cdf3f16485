/** Reporter that ends a run with its slowest tests, like `--durations` of pytest, and with what failed in it. */
import type { Reporter, SerializedError, TestCase, TestModule } from "vitest/node";

const SLOWEST_COUNT = 20;

export default class RunSummary implements Reporter {
  onTestRunEnd(modules: readonly TestModule[], unhandledErrors: readonly SerializedError[]): void {
    const tests = modules.flatMap(({ children }) => [...children.allTests()]);
    if (tests.length > SLOWEST_COUNT) list(`slowest ${SLOWEST_COUNT} tests`, slowest(tests));
    const failures = [
      ...modules.flatMap((module) => module.errors().map((error) => failure(module.relativeModuleId, error))),
      ...modules.flatMap(({ children }) =>
        [...children.allSuites()].flatMap((suite) =>
          suite.errors().map((error) => failure(`${suite.module.relativeModuleId} > ${suite.fullName}`, error)),
        ),
      ),
      ...tests.flatMap((test) => (test.result().errors ?? []).map((error) => failure(fullName(test), error))),
      ...unhandledErrors.map((error) => failure("outside of a test", error)),
    ];
    if (failures.length > 0) list("failed", failures);
  }
}

function slowest(tests: TestCase[]): string[] {
  return tests
    .map((test) => ({ name: fullName(test), seconds: (test.diagnostic()?.duration ?? 0) / 1000 }))
    .sort((a, b) => b.seconds - a.seconds)
    .slice(0, SLOWEST_COUNT)
    .map(({ name, seconds }) => `${seconds.toFixed(2).padStart(7)} s  ${name}`);
}

function fullName(test: TestCase): string {
  return `${test.module.relativeModuleId} > ${test.fullName}`;
}

/** A failure in one line: where, and the first line of the error. */
function failure(where: string, error: SerializedError): string {
  return `  ${where}: ${error.message.split("\n", 1)[0]}`;
}

function list(title: string, lines: string[]): void {
  console.log([`\n${title}:`, ...lines, ""].join("\n"));
}
