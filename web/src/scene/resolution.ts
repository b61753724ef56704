/**
 * How finely to draw: as finely as the screen shows while nothing moves, and while something moves as finely as keeps up with the
 * hand. Without a graphics card a full picture takes a tenth of a second and more.
 */

/** Shares of the screen's resolution. */
const STEPS = [1, 0.7, 0.5, 0.35] as const;
const SLOW_MS = 45;
const FAST_MS = 20;
/** So many slow frames make it coarser, so many fast ones finer: changing it costs a frame or two itself. */
const SLOW_FRAMES = 3;
const FAST_FRAMES = 90;
/** Frames further apart than this do not belong to one motion. */
const PAUSE_MS = 1000;
/** A motion is over when nothing was drawn for this long. */
const REST_MS = 700;

export class Resolution {
  private step = 0;
  private slow = 0;
  private fast = 0;
  private last = -Infinity;
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `redraw` draws at full resolution, after a motion that was not. */
  constructor(private readonly redraw: () => void) {}

  /** The share of the screen's resolution at which a frame of a motion is drawn. */
  next(now: number): number {
    const took = now - this.last;
    this.last = now;
    if (took < FAST_MS) this.fast++;
    else if (took > SLOW_MS && took < PAUSE_MS) this.slow++;
    if (this.slow >= SLOW_FRAMES) this.change(1);
    else if (this.fast >= FAST_FRAMES) this.change(-1);
    clearTimeout(this.timer);
    if (this.step > 0) this.timer = setTimeout(this.redraw, REST_MS);
    return STEPS[this.step] ?? 1;
  }

  private change(by: number): void {
    this.step = Math.min(STEPS.length - 1, Math.max(0, this.step + by));
    this.slow = this.fast = 0;
  }
}
