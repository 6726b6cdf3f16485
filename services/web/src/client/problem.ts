/** Problem of an HTTP request (RFC 9457). */

import { pageTranslator } from "../i18n/translator";

/** Failed HTTP request, with texts for the user. `status` is 0 if no server answered. */
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

  /** Parse the body of a response with `status`; a body in any other format gets generic texts. */
  static from(status: number, body: string, translator = pageTranslator): ProblemError {
    const { translate, translateServerText } = translator;
    let document: Record<string, unknown> = {};
    try {
      const parsed: unknown = JSON.parse(body);
      if (typeof parsed === "object" && parsed !== null) document = parsed as Record<string, unknown>;
    } catch {
      // the response of a proxy, or an empty body: only the status is known
    }
    const text = (value: unknown) => (typeof value === "string" ? translateServerText(value) : null);
    return new ProblemError(
      status,
      text(document.title) ?? translate("The server refused"),
      text(document.detail) ?? translate("it answered {status}", { status }),
      text(document.hint),
      typeof document.line === "number" ? document.line : null,
      typeof document.field === "string" ? document.field : null,
      translator,
    );
  }

  /** Create the problem of a request without an answer. */
  static unreachable(translator = pageTranslator): ProblemError {
    const { translate } = translator;
    return new ProblemError(
      0,
      translate("No answer"),
      translate("the server cannot be reached"),
      translate("check your connection, then try again"),
      null,
      null,
      translator,
    );
  }
}
