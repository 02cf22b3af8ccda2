// Curves over time, with limits and marks. A curve is drawn with the least and the greatest value
// of each pixel column, so that no peak is lost, whatever the width.

import {isKnown, lastIndexAt} from './data.js';
import {element, number, swatch} from './format.js';
import {CHART_MARGIN, TimeChart} from './time_chart.js';

let clipCount = 0;

/** The known values of a curve; a gap longer than `maxGap` s breaks the curve. */
function knownPoints(times, values) {
  const t = [];
  const v = [];
  for (let i = 0; i < times.length; ++i) {
    if (!isKnown(values[i])) continue;
    t.push(times[i]);
    v.push(values[i]);
  }
  return {t, v};
}

/** Points to draw between two times: [time, value], null for a break. */
function thinned(points, begin, end, columns, maxGap) {
  const list = [];
  const first = Math.max(lastIndexAt(points.t, begin), 0);
  const last = Math.min(lastIndexAt(points.t, end) + 2, points.t.length);
  const width = (end - begin) / columns;
  let i = first;
  while (i < last) {
    const column = Math.floor((points.t[i] - begin) / width);
    let least = i;
    let greatest = i;
    let next = i + 1;
    while (next < last && Math.floor((points.t[next] - begin) / width) === column &&
           points.t[next] - points.t[next - 1] <= maxGap) {
      if (points.v[next] < points.v[least]) least = next;
      if (points.v[next] > points.v[greatest]) greatest = next;
      ++next;
    }
    for (const at of new Set([i, Math.min(least, greatest), Math.max(least, greatest), next - 1])) {
      list.push([points.t[at], points.v[at]]);
    }
    if (next < last && points.t[next] - points.t[next - 1] > maxGap) list.push(null);
    i = next;
  }
  return list;
}

export class LineChart extends TimeChart {
  /**
   * `options`: title, unit, digits, times, maxGap (s), and
   *   series  [{name, values, colour, kind, step, scale}]  kind: '', 'dashed' or 'dotted'
   *   limits  [{name, value, colour}]
   *   marks   [{t, value, colour, name}]
   *   goals   times of local goals
   *   domain  [least, greatest] that is always shown
   *   ceiling greatest value that is shown: curves above it are cut off
   *   down    true: greater values are lower (depth)
   */
  constructor(host, cursor, view, options) {
    super(host, cursor, view, {height: 176, ...options});
    this.options = options;
    this.series =
        options.series
            .map((series) => ({...series, points: knownPoints(options.times, series.values)}))
            .filter((series) => series.points.t.length > 0);
    this.limits = (options.limits ?? []).filter((limit) => isKnown(limit.value));
    this.marks = options.marks ?? [];
    this.goals = options.goals ?? [];
    this.y = d3.scaleLinear();
    this.addKeys();
    this.grid = this.content.append('g').attr('class', 'grid-lines').attr('aria-hidden', 'true');
    const clip = `clip-${++clipCount}`;
    this.clip = this.svg.append('clipPath').attr('id', clip).append('rect');
    this.curves = this.content.append('g').attr('clip-path', `url(#${clip})`);
    this.signs = this.content.append('g');
    this.start();
  }

  addKeys() {
    for (const series of this.series) {
      series.reading = element('b');
      this.caption.append(element(
          'span', {class: 'key'}, swatch(series.colour, series.kind ?? ''), series.name,
          series.reading));
    }
    for (const limit of this.limits) {
      this.caption.append(element(
          'span', {class: 'key muted'}, swatch(limit.colour, 'dotted'),
          `${limit.name} ${number(limit.value, this.options.digits, this.options.unit)}`));
    }
    if (this.goals.length) {
      this.caption.append(
          element('span', {class: 'key muted'}, swatch('--planned'), 'ticks: new local goal'));
    }
  }

  /** The range of values of the part shown, limits included. */
  range() {
    let [least, greatest] = this.options.domain ?? [Infinity, -Infinity];
    const include = (value) => {
      least = Math.min(least, value);
      greatest = Math.max(greatest, value);
    };
    for (const series of this.series) {
      const {t, v} = series.points;
      const end = lastIndexAt(t, this.view.end);
      for (let i = Math.max(lastIndexAt(t, this.view.begin), 0); i <= end; ++i) include(v[i]);
    }
    for (const limit of this.limits) include(limit.value);
    for (const mark of this.marks) include(mark.value);
    greatest = Math.min(greatest, this.options.ceiling ?? Infinity);
    if (!(greatest > least)) greatest = least + 1;
    return this.options.down ? [greatest, least] : [least, greatest];
  }

  draw() {
    const right = this.width - CHART_MARGIN.right;
    this.y.domain(this.range()).nice(4).range([this.plotBottom, CHART_MARGIN.top]);
    const axis = d3.axisLeft(this.y).ticks(4).tickSize(-(right - CHART_MARGIN.left)).tickPadding(6);
    this.grid.attr('transform', `translate(${CHART_MARGIN.left} 0)`).call(axis);
    this.grid.select('.domain').remove();
    this.grid.selectAll('line').attr('class', 'grid');
    this.clip.attr('x', CHART_MARGIN.left)
        .attr('y', CHART_MARGIN.top - 2)
        .attr('width', right - CHART_MARGIN.left)
        .attr('height', this.plotBottom - CHART_MARGIN.top + 4);
    this.curves.selectAll('*').remove();
    this.signs.selectAll('*').remove();
    this.drawGoals();
    this.drawLimits(right);
    for (const series of this.series) this.drawSeries(series);
    this.drawMarks();
  }

  drawGoals() {
    for (const t of this.goals) {
      if (t < this.view.begin || t > this.view.end) continue;
      const x = this.x(t);
      this.curves.append('line')
          .attr('class', 'local-goal')
          .attr('x1', x)
          .attr('x2', x)
          .attr('y1', this.plotBottom)
          .attr('y2', this.plotBottom - 9);
    }
  }

  drawLimits(right) {
    for (const limit of this.limits) {
      const y = this.y(limit.value);
      this.curves.append('line')
          .attr('class', 'limit')
          .style('--stroke', `var(${limit.colour})`)
          .attr('x1', CHART_MARGIN.left)
          .attr('x2', right)
          .attr('y1', y)
          .attr('y2', y);
    }
  }

  drawSeries(series) {
    const points =
        thinned(series.points, this.view.begin, this.view.end, this.width, this.options.maxGap);
    const line = d3.line()
                     .defined((point) => point !== null)
                     .x((point) => this.x(point[0]))
                     .y((point) => this.y(point[1]));
    if (series.step) line.curve(d3.curveStepAfter);
    this.curves.append('path')
        .attr('class', `series ${series.kind ?? ''}`)
        .style('--stroke', `var(${series.colour})`)
        .attr('d', line(points));
  }

  drawMarks() {
    for (const mark of this.marks) {
      if (mark.t < this.view.begin || mark.t > this.view.end) continue;
      this.signs.append('path')
          .attr('class', 'mark')
          .style('--stroke', `var(${mark.colour})`)
          .attr('d', d3.symbol().type(d3.symbolDiamond).size(90)())
          .attr('transform', `translate(${this.x(mark.t)} ${this.y(mark.value)})`)
          .append('title')
          .text(mark.name);
    }
  }

  update(t) {
    this.dots.selectAll('*').remove();
    for (const series of this.series) {
      const i = lastIndexAt(series.points.t, t + 1e-3);
      const isFresh = i >= 0 && t - series.points.t[i] <= this.options.maxGap;
      series.reading.textContent =
          isFresh ? number(series.points.v[i], this.options.digits, this.options.unit) : '–';
      if (!isFresh || t < this.view.begin || t > this.view.end ||
          this.y(series.points.v[i]) < CHART_MARGIN.top)
        continue;
      this.dots.append('circle')
          .attr('class', 'now-dot')
          .style('--stroke', `var(${series.colour})`)
          .attr('r', 4)
          .attr('cx', this.x(t))
          .attr('cy', this.y(series.points.v[i]));
    }
  }
}
