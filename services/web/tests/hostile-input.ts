/** What becomes of damaged and hostile bytes: they are read, or refused with the one error type of their room. */
export class HostileInputCounts {
  private read = 0;
  private refused = 0;
  private slowest = 0;

  /** @param refusal the error type */
  constructor(private readonly refusal: new (message: string) => Error) {}

  /** Runs `attempt`; anything else that it throws is a fault. */
  run(attempt: () => void): void {
    const start = performance.now();
    try {
      attempt();
      this.read++;
    } catch (error) {
      if (!(error instanceof this.refusal)) throw error;
      this.refused++;
    }
    this.slowest = Math.max(this.slowest, performance.now() - start);
  }

  /** Prints the counts. */
  print(what: string): void {
    const { read, refused, slowest } = this;
    console.log(
      `hostile ${what}: ${read + refused} inputs, ${read} read, ${refused} refused, the slowest in ${slowest.toFixed(1)} ms`,
    );
  }
}
