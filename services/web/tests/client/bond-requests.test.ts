import { beforeEach, describe, expect, test } from "vitest";
import { BondRequests, type LimbPair, orderedPair } from "../../src/client/bond-requests";
import { LimbHold } from "../../src/client/limb-hold";

const PAIR: LimbPair = [0, 5];
let requests: BondRequests;
let holds: LimbHold[];

beforeEach(() => {
  requests = new BondRequests();
  holds = Array.from({ length: 16 }, (_, limb) => new LimbHold(limb));
});

/** Hold limbs here, as the session has granted them. */
function grant(...limbs: number[]): void {
  for (const limb of limbs) {
    holds[limb].claim(0);
    holds[limb].grant(1, 0);
  }
}

test("pair has the lower limb first", () => {
  expect([orderedPair(5, 0), orderedPair(0, 5)]).toEqual([PAIR, PAIR]);
});

describe("a requested bond", () => {
  test("counts before the session lists it, for five seconds", () => {
    requests.request(PAIR, 1_000);
    expect(requests.effective([], 1_000)).toEqual([PAIR]);
    expect(requests.effective([[1, 4]], 5_999)).toEqual([[1, 4], PAIR]);
    expect(requests.effective([], 6_000)).toEqual([]);
  });

  test("is the session's once it is listed, and does not count twice", () => {
    requests.request(PAIR, 0);
    requests.confirm([PAIR]);
    expect([requests.effective([PAIR], 1), requests.effective([], 1)]).toEqual([[PAIR], []]);
  });

  test("that is refused no longer counts", () => {
    requests.request(PAIR, 0);
    requests.applyEnd(PAIR, "held", holds);
    expect(requests.effective([], 1)).toEqual([]);
  });
});

test("a bond that ends here does not count while the session still lists it", () => {
  requests.end(PAIR, true);
  expect(requests.effective([PAIR, [1, 4]], 1)).toEqual([[1, 4]]);
  requests.confirm([]);
  expect(requests.effective([PAIR], 1)).toEqual([PAIR]);
});

describe("a lost bond", () => {
  beforeEach(() => {
    requests.request(PAIR, 0);
    requests.confirm([PAIR]);
  });

  test("is requested again once all its own hands are granted again", () => {
    grant(0, 5);
    requests.disconnect();
    for (const limb of PAIR) holds[limb].revoke();
    holds[0].grant(2, 0);
    expect([requests.takeLost(0, holds, 1), requests.effective([], 1)]).toEqual([[], []]);
    holds[5].grant(2, 0);
    expect(requests.takeLost(5, holds, 1)).toEqual([PAIR]);
    expect([requests.takeLost(5, holds, 2), requests.effective([], 2)]).toEqual([[], [PAIR]]);
  });

  test("with a led hand needs the grant of the other only", () => {
    grant(0);
    holds[0].revoke();
    requests.applyEnd(PAIR, "lost", holds);
    holds[0].grant(2, 0);
    expect([requests.takeLost(1, holds, 1), requests.takeLost(0, holds, 1)]).toEqual([[], [PAIR]]);
  });

  test("through another puppeteer's hand is forgotten, and so is one that was let go", () => {
    grant(0);
    requests.applyEnd(PAIR, "lost", holds);
    requests.disconnect();
    expect(requests.takeLost(0, holds, 1)).toEqual([]);
    requests.request(PAIR, 0);
    requests.end(PAIR, false);
    requests.disconnect();
    expect(requests.takeLost(0, holds, 1)).toEqual([]);
  });
});
