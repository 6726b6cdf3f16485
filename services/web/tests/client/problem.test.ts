import { expect, test } from "vitest";
import { ProblemError } from "../../src/client/problem";

test.each(["", "<html>502</html>", "null", "[1]", '{"title": 5}'])("what a proxy answers has the status as its words: %j", (body) => {
  const problem = ProblemError.from(502, body);
  expect([problem.status, problem.title, problem.detail]).toEqual([502, "The server refused", "it answered 502"]);
  expect([problem.hint, problem.line]).toEqual([null, null]);
});
