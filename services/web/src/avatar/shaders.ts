/** Completion of three.js's shaders for avatars. */
import { ShaderChunk, ShaderLib } from "three";
import { programs, removedCode } from "./removed-shaders";

/** Add the code that only avatars need to the shaders of three.js. Call it once, before an avatar is drawn. */
export function restoreShaders(): void {
  const chunks: Record<string, string> = ShaderChunk;
  for (const [name, parts] of Object.entries(removedCode)) {
    const remaining = parts.values();
    chunks[name] = chunks[name].replace(/^#error$/gm, () => remaining.next().value ?? "");
  }
  for (const [id, [vertex, fragment]] of Object.entries(programs))
    Object.assign(ShaderLib[id], { vertexShader: chunks[vertex], fragmentShader: chunks[fragment] });
}
