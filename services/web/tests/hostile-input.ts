/** Counts of damaged and hostile inputs: each is read, or rejected with the package's error type. */
export class HostileInputCounts {
  private read = 0;
  private rejected = 0;
  private slowest = 0;

  /** @param rejection the error type of rejected inputs */
  constructor(private readonly rejection: new (message: string) => Error) {}

  /** Run `attempt`. Errors of any other type are rethrown. */
  run(attempt: () => void): void {
    const start = performance.now();
    try {
      attempt();
      this.read++;
    } catch (error) {
      if (!(error instanceof this.rejection)) throw error;
      this.rejected++;
    }
    this.slowest = Math.max(this.slowest, performance.now() - start);
  }

  /** Print the counts. */
  print(label: string): void {
    const { read, rejected, slowest } = this;
    console.log(
      `hostile ${label}: ${read + rejected} inputs, ${read} read, ${rejected} rejected, ${slowest.toFixed(1)} ms at most`,
    );
  }
}
