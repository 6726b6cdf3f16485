/** Access of the workers to the resources of the run. */
import { inject } from "vitest";

/** Get a shared resource, which starts if it has not. */
export async function getShared<T>(path: string): Promise<T> {
  const response = await fetch(inject("sharedResources") + path);
  if (!response.ok) throw new Error(await response.text());
  return (await response.json()) as T;
}
