import { expect, test } from "vitest";
import { ProblemError } from "../../src/client/problem";
import { loadJapaneseTranslator } from "../../src/i18n/language";

test.each(["", "<html>502</html>", "null", "[1]", '{"title": 5}'])(
  "what a proxy answers has the status as its words: %j",
  (body) => {
    const problem = ProblemError.from(502, body);
    expect([problem.status, problem.title, problem.detail]).toEqual([502, "The server refused", "it answered 502"]);
    expect([problem.hint, problem.line]).toEqual([null, null]);
  },
);

test("it is told in the words of who asked", async () => {
  const speech = await loadJapaneseTranslator();
  const problem = ProblemError.from(
    404,
    JSON.stringify({ title: "No such session", detail: "there is no session abc" }),
    speech,
  );
  expect([problem.title, problem.detail, problem.message]).toEqual([
    "その舞台は見つかりません",
    "舞台abcはありません",
    "その舞台は見つかりません：舞台abcはありません",
  ]);
  expect(ProblemError.unreachable(speech).title).toBe("サーバーから応答がありません");
  expect(ProblemError.unreachable().title).toBe("No answer");
});
