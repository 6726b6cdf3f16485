import { expect, test } from "vitest";
import { ProblemError } from "../../src/client/problem";
import { loadJapaneseTranslator } from "../../src/i18n/language";

test.each(["", "<html>502</html>", "null", "[1]", '{"title": 5}'])(
  "body %j gets generic texts with the status",
  (body) => {
    const problem = ProblemError.from(502, body);
    expect([problem.status, problem.title, problem.detail]).toEqual([502, "The server refused", "it answered 502"]);
    expect([problem.hint, problem.line]).toEqual([null, null]);
  },
);

test("texts are in the language of the translator", async () => {
  const translator = await loadJapaneseTranslator();
  const problem = ProblemError.from(
    404,
    JSON.stringify({ title: "No such session", detail: "there is no session abc" }),
    translator,
  );
  expect([problem.title, problem.detail, problem.message]).toEqual([
    "その舞台は見つかりません",
    "舞台abcはありません",
    "その舞台は見つかりません：舞台abcはありません",
  ]);
  expect(ProblemError.unreachable(translator).title).toBe("サーバーから応答がありません");
  expect(ProblemError.unreachable().title).toBe("No answer");
});
