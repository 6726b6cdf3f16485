/**
 * Which members of classes nothing built in says the name of, and a module's text without them: bundlers leave out what is not
 * imported, but take classes whole. Words within texts count as said, too, as a member may be called by one.
 */
import { parseAst } from "vite";

export interface BuiltModule {
  /** What of its text is built in. */
  code: string;
  /** Whether members of its classes may go. */
  cuttable: boolean;
}

interface Node {
  type: string;
  start: number;
  end: number;
  [key: string]: unknown;
}

/** Called by the language itself. */
const IMPLICIT = new Set(["constructor", "toString", "valueOf", "then"]);

/** The name where a node is a member: a class's method, getter or setter, or `this.NAME = function ...`; else null. */
function memberName(node: Node): string | null {
  if (node.type === "MethodDefinition") {
    const { key, computed } = node as unknown as { key: Node; computed: boolean };
    return !computed && key.type === "Identifier" && !IMPLICIT.has(key["name"] as string)
      ? (key["name"] as string)
      : null;
  }
  const assigned = node.type === "ExpressionStatement" ? (node["expression"] as Node) : null;
  if (assigned?.type !== "AssignmentExpression" || assigned["operator"] !== "=") return null;
  const { left, right } = assigned as unknown as { left: Node; right: Node };
  if (!/^(Arrow)?FunctionExpression$/.test(right.type) || left.type !== "MemberExpression" || left["computed"])
    return null;
  return (left["object"] as Node).type === "ThisExpression" ? ((left["property"] as Node)["name"] as string) : null;
}

/** Tells `said` of every word of a program, except within members that `member` is told of and answers true for. */
function words(node: unknown, said: (word: string) => void, member: (name: string, node: Node) => boolean): void {
  if (Array.isArray(node)) {
    for (const one of node) words(one, said, member);
    return;
  }
  if (typeof node !== "object" || node === null) return;
  const one = node as Node;
  const name = memberName(one);
  if (name !== null && member(name, one)) return;
  if (one.type === "Identifier") said(one["name"] as string);
  const text =
    one.type === "Literal"
      ? one["value"]
      : one.type === "TemplateElement"
        ? (one["value"] as { raw: string }).raw
        : null;
  if (typeof text === "string") for (const [word] of text.matchAll(/[A-Za-z_$][\w$]*/g)) said(word);
  for (const value of Object.values(one)) if (typeof value === "object") words(value, said, member);
}

/** Names of members of cuttable modules that nothing says but such members themselves. */
export function unusedMembers(modules: readonly BuiltModule[]): Set<string> {
  const said: string[] = [];
  /** What a member says, which counts once the member's own name was said. */
  const members = new Map<string, Set<string>>();
  for (const { code, cuttable } of modules) {
    words(
      parseAst(code),
      (word) => said.push(word),
      (name, node) => {
        if (!cuttable) return false;
        const says = members.get(name) ?? new Set<string>();
        members.set(name, says);
        const inner = (word: string) => says.add(word);
        words(
          node.type === "MethodDefinition" ? node["value"] : (node["expression"] as Node)["right"],
          inner,
          () => false,
        );
        return true;
      },
    );
  }
  for (let word = said.pop(); word !== undefined; word = said.pop()) {
    const says = members.get(word);
    if (!says) continue;
    members.delete(word);
    said.push(...says);
  }
  return new Set(members.keys());
}

/** A module's text without the members of these names. */
export function withoutMembers(code: string, names: ReadonlySet<string>): string {
  const cuts: Node[] = [];
  words(
    parseAst(code),
    () => undefined,
    (name, node) => names.has(name) && cuts.push(node) > 0,
  );
  let rest = code;
  for (const { start, end } of cuts.sort((one, other) => other.start - one.start))
    rest = rest.slice(0, start) + rest.slice(end);
  return rest;
}
