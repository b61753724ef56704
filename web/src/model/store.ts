/** A value that others want to hear of when it changes. */

export class Store<T> {
  private listeners: ((value: T, before: T) => void)[] = [];

  constructor(private value: T) {}

  get(): T {
    return this.value;
  }

  set(value: T): void {
    const before = this.value;
    if (value === before) return;
    this.value = value;
    for (const listener of this.listeners) listener(value, before);
  }

  /** Replaces some fields of a record. */
  patch(change: Partial<T>): void {
    this.set({ ...this.value, ...change });
  }

  /** Calls `listener` now and at every change. */
  follow(listener: (value: T, before: T) => void): void {
    this.listeners.push(listener);
    listener(this.value, this.value);
  }
}
