/** The link by which others come to the same stage. */
import { guarded } from "./client/access";
import { shareSession } from "./client/library";
import { ProblemError } from "./client/problem";
import type { Toast } from "./page/toast";
import type { Room } from "./room";
import { say } from "./words/say";

/** Copies the link of what is watched, and says so; where it cannot be copied it is shown. On a server that asks for one it is a link that lets others watch. */
export async function shareLink(room: Pick<Room, "id"> | null, toast: Toast): Promise<void> {
  const url = new URL(location.href);
  url.search = room ? `?session=${encodeURIComponent(room.id)}` : "";
  let copied = say("Link copied");
  if (guarded() && room) {
    try {
      url.href = new URL(await shareSession(room.id), location.href).href;
      copied = say("Link copied: who has it may watch, for a week");
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      toast(say("{title}: {detail}", error));
      return;
    }
  }
  try {
    await navigator.clipboard.writeText(url.href);
    toast(copied);
  } catch {
    toast(say("Copy this link: {link}", { link: url.href }));
  }
}
