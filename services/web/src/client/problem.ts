import { pageTranslator } from "../i18n/translator";

/** What went wrong over HTTP, in words for the person who gets it (RFC 9457). `status` is 0 where no server answered. */
export class ProblemError extends Error {
  override readonly name = "ProblemError";

  constructor(
    readonly status: number,
    readonly title: string,
    readonly detail: string,
    readonly hint: string | null = null,
    readonly line: number | null = null,
    readonly field: string | null = null,
    { translate } = pageTranslator,
  ) {
    super(translate("{title}: {detail}", { title, detail }));
  }

  /** The problem in the body of an answer of `status`, of whatever form, in words of `speech`. */
  static from(status: number, body: string, speech = pageTranslator): ProblemError {
    const { translate, translateServerText } = speech;
    let said: Record<string, unknown> = {};
    try {
      const parsed: unknown = JSON.parse(body);
      if (typeof parsed === "object" && parsed !== null) said = parsed as Record<string, unknown>;
    } catch {
      // a proxy's page, or nothing: the status has to do
    }
    const text = (value: unknown) => (typeof value === "string" ? translateServerText(value) : null);
    return new ProblemError(
      status,
      text(said.title) ?? translate("The server refused"),
      text(said.detail) ?? translate("it answered {status}", { status }),
      text(said.hint),
      typeof said.line === "number" ? said.line : null,
      typeof said.field === "string" ? said.field : null,
      speech,
    );
  }

  static unreachable(speech = pageTranslator): ProblemError {
    const { translate } = speech;
    return new ProblemError(
      0,
      translate("No answer"),
      translate("the server cannot be reached"),
      translate("check your connection, then try again"),
      null,
      null,
      speech,
    );
  }
}
