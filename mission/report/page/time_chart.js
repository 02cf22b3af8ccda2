// What every chart over time has: the time axis, the cursor line, and dragging.

import {clock, element} from './format.js';

export const CHART_MARGIN = {
  left: 50,
  right: 20,
  top: 6,
  bottom: 24
};
const MIN_WIDTH = 240;
const PIXELS_PER_TICK = 80;
const TICKS =
    [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400];  // s

/** Round times in [begin, end], at most `count` or so. */
function roundTimes(begin, end, count) {
  const step = TICKS.find((seconds) => (end - begin) / seconds <= count) ?? (end - begin) / count;
  return d3.range(Math.ceil(begin / step) * step, end + 1e-6, step);
}

export class TimeChart {
  /** `options`: title, height (px), description. Sub-classes draw in draw() and update(t). */
  constructor(host, cursor, view, options) {
    this.cursor = cursor;
    this.view = view;
    this.height = options.height;
    this.caption = element('figcaption', {}, element('h3', {}, options.title));
    this.svg = d3.create('svg')
                   .attr('role', 'img')
                   .attr('aria-label', options.description ?? options.title);
    this.figure = element('figure', {class: 'chart'}, this.caption, this.svg.node());
    host.append(this.figure);
    this.width = 0;
    this.x = d3.scaleLinear();
    this.content = this.svg.append('g');
    this.axis = this.svg.append('g').attr('aria-hidden', 'true');
    this.now = this.svg.append('line').attr('class', 'now');
    this.dots = this.svg.append('g');
    this.drag();
  }

  /** Called once by the sub-class when it is complete. */
  start() {
    new ResizeObserver(() => this.resize()).observe(this.figure);
    this.resize();
    this.view.subscribe(() => this.redraw());
    this.cursor.subscribe((t) => this.move(t));
  }

  get plotBottom() {
    return this.height - CHART_MARGIN.bottom;
  }

  resize() {
    const width = Math.max(Math.round(this.figure.clientWidth), MIN_WIDTH);
    if (width === this.width) return;
    this.width = width;
    this.svg.attr('viewBox', `0 0 ${width} ${this.height}`).attr('height', this.height);
    this.redraw();
  }

  redraw() {
    if (this.width === 0) return;
    this.x.domain([this.view.begin, this.view.end]).range([
      CHART_MARGIN.left, this.width - CHART_MARGIN.right
    ]);
    const times =
        roundTimes(this.view.begin, this.view.end, Math.max(this.width / PIXELS_PER_TICK, 3));
    const digits = times.length > 1 && times[1] - times[0] < 1 ? 1 : 0;
    const ticks = d3.axisBottom(this.x).tickValues(times).tickSizeOuter(0).tickFormat(
        (t) => clock(t, digits));
    this.axis.attr('transform', `translate(0 ${this.plotBottom})`).call(ticks);
    this.draw();
    this.move(this.cursor.time);
  }

  move(t) {
    if (this.width === 0) return;
    const x = this.x(t);
    const isVisible = t >= this.view.begin && t <= this.view.end;
    this.now.attr('x1', x)
        .attr('x2', x)
        .attr('y1', CHART_MARGIN.top)
        .attr('y2', this.plotBottom)
        .attr('visibility', isVisible ? 'visible' : 'hidden');
    this.update(t);
  }

  drag() {
    const node = this.svg.node();
    const moveTo = (event) => {
      const box = node.getBoundingClientRect();
      this.cursor.set(this.x.invert((event.clientX - box.left) * this.width / box.width));
    };
    let isDragging = false;
    node.addEventListener('pointerdown', (event) => {
      isDragging = true;
      node.setPointerCapture(event.pointerId);
      moveTo(event);
    });
    node.addEventListener('pointermove', (event) => {
      if (isDragging) moveTo(event);
    });
    for (const end of ['pointerup', 'pointercancel'])
      node.addEventListener(end, () => {
        isDragging = false;
      });
  }

  /** What this view shows, for the self-test. */
  shown() {
    return this.now.attr('x1') + ' ' + this.caption.textContent;
  }
}
