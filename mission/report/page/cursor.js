// The one time cursor that links all views.

export class TimeCursor {
  /** Times from 0 to `end`, s. */
  constructor(end) {
    this.end = end;
    this.time = 0;
    this.rate = 1;
    this.listeners = [];
    this.lastFrame = null;
  }

  /** Calls `listener(t)` now and after every change. */
  subscribe(listener) {
    this.listeners.push(listener);
    listener(this.time);
  }

  set(time) {
    this.time = Math.min(Math.max(time, 0), this.end);
    for (const listener of this.listeners) listener(this.time);
  }

  step(by) {
    this.set(this.time + by);
  }

  get isPlaying() {
    return this.lastFrame !== null;
  }

  play() {
    if (this.isPlaying) return;
    if (this.time >= this.end) this.set(0);
    this.lastFrame = performance.now();
    requestAnimationFrame((now) => this.advance(now));
    this.set(this.time);
  }

  pause() {
    this.lastFrame = null;
    this.set(this.time);
  }

  advance(now) {
    if (!this.isPlaying) return;
    const elapsed = (now - this.lastFrame) / 1000;
    this.lastFrame = now;
    this.step(Math.max(elapsed, 0) * this.rate);
    if (this.time >= this.end)
      this.pause();
    else
      requestAnimationFrame((next) => this.advance(next));
  }
}

/** The part of the dive that the charts show. It follows the cursor. */
export class TimeView {
  constructor(cursor) {
    this.cursor = cursor;
    this.length = cursor.end;
    this.begin = 0;
    this.listeners = [];
    cursor.subscribe((t) => this.follow(t));
  }

  get end() {
    return this.begin + this.length;
  }

  subscribe(listener) {
    this.listeners.push(listener);
    listener();
  }

  /** Shows `length` seconds around the cursor; all of the dive if it is shorter. */
  show(length) {
    this.length = Math.min(length, this.cursor.end);
    this.moveTo(this.cursor.time - this.length / 2);
  }

  follow(t) {
    const margin = 0.1 * this.length;
    if (t < this.begin + margin && this.begin > 0)
      this.moveTo(t - 0.5 * this.length);
    else if (t > this.end - margin && this.end < this.cursor.end)
      this.moveTo(t - 0.5 * this.length);
  }

  moveTo(begin) {
    this.begin = Math.min(Math.max(begin, 0), this.cursor.end - this.length);
    for (const listener of this.listeners) listener();
  }
}
