/**
 * Newest pose wins: one question in flight, and of those that arrive meanwhile only the last is kept.
 *
 * An answer that is on its way is worth waiting for, so that a moving hand sees answers at all; one that takes longer than
 * the patience is given up as soon as there is something newer to ask.
 */

export class NewestWins<Question, Answer> {
  private waiting: { question: Question } | undefined;
  private flight: { abort: AbortController; since: number } | undefined;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly ask: (question: Question, signal: AbortSignal) => Promise<Answer>,
    private readonly take: (answer: Answer, question: Question) => void,
    private readonly patienceMs: number,
  ) {}

  /** Whether nothing is asked and nothing waits. */
  get idle(): boolean {
    return this.flight === undefined && this.waiting === undefined;
  }

  offer(question: Question): void {
    this.waiting = { question };
    if (this.flight) this.giveUpInTime();
    else void this.run();
  }

  private giveUpInTime(): void {
    const { flight } = this;
    if (!flight || this.timer !== undefined) return;
    const left = this.patienceMs - (performance.now() - flight.since);
    this.timer = setTimeout(() => flight.abort.abort(), Math.max(0, left));
  }

  private async run(): Promise<void> {
    while (this.waiting) {
      const { question } = this.waiting;
      this.waiting = undefined;
      const abort = new AbortController();
      this.flight = { abort, since: performance.now() };
      const answer = await this.ask(question, abort.signal);
      clearTimeout(this.timer);
      this.timer = undefined;
      this.flight = undefined;
      if (!abort.signal.aborted) this.take(answer, question);
    }
  }
}
