// What was the case when: one row of bands for each question (state, failsafe, overhead,
// estimator).

import {lastIndexAt} from './data.js';
import {element} from './format.js';
import {CHART_MARGIN, TimeChart} from './time_chart.js';

const ROW = 26;
const CHARACTER = 8;  // px, of a label

/** Bands {begin, end, text} from the value of each sample. */
export function bandsOf(times, end, textAt) {
  const bands = [];
  for (let i = 0; i < times.length; ++i) {
    const text = textAt(i);
    if (bands.length && bands[bands.length - 1].text === text) continue;
    if (bands.length) bands[bands.length - 1].end = times[i];
    bands.push({begin: times[i], end, text});
  }
  return bands;
}

export class BandChart extends TimeChart {
  /**
   * `options`: title, and
   *   rows   [{name, bands, colourOf(text, index)}]
   *   marks  [{t, colour, symbol, name}], drawn below the rows
   */
  constructor(host, cursor, view, options) {
    const height = CHART_MARGIN.top + ROW * (2 * options.rows.length) + 18 + CHART_MARGIN.bottom;
    super(host, cursor, view, {...options, height});
    this.rows = options.rows;
    this.marks = options.marks;
    this.reading = element('span', {class: 'key'});
    this.caption.append(this.reading);
    for (const row of this.rows) row.begins = row.bands.map((band) => band.begin);
    this.start();
  }

  draw() {
    this.content.selectAll('*').remove();
    this.rows.forEach((row, index) => this.drawRow(row, CHART_MARGIN.top + 2 * ROW * index));
    const y = CHART_MARGIN.top + 2 * ROW * this.rows.length + 8;
    for (const mark of this.marks) {
      if (mark.t < this.view.begin || mark.t > this.view.end) continue;
      this.content.append('path')
          .attr('class', 'mark')
          .style('--stroke', `var(${mark.colour})`)
          .attr('d', d3.symbol().type(mark.symbol).size(80)())
          .attr('transform', `translate(${this.x(mark.t)} ${y})`)
          .append('title')
          .text(mark.name);
    }
  }

  drawRow(row, top) {
    this.content.append('text')
        .attr('class', 'row-label')
        .attr('x', CHART_MARGIN.left)
        .attr('y', top + 16)
        .text(row.name);
    row.bands.forEach((band, index) => {
      if (band.end < this.view.begin || band.begin > this.view.end) return;
      const left = Math.max(this.x(band.begin), CHART_MARGIN.left);
      const width = Math.min(this.x(band.end), this.width - CHART_MARGIN.right) - left;
      if (width <= 0) return;
      const group = this.content.append('g');
      group.append('title').text(band.text);
      group.append('rect')
          .attr('class', 'band')
          .attr('x', left)
          .attr('y', top + ROW - 4)
          .attr('width', width)
          .attr('height', ROW - 2)
          .attr('fill', row.colourOf(band.text, index));
      const room = Math.floor((width - 8) / CHARACTER);
      if (room < 3) return;
      const text = band.text.length <= room ? band.text : band.text.slice(0, room - 1) + '…';
      group.append('text')
          .attr('class', 'band-label')
          .attr('x', left + 4)
          .attr('y', top + 2 * ROW - 13)
          .text(text);
    });
  }

  update(t) {
    this.reading.textContent = this.rows
                                   .map((row) => {
                                     const i = lastIndexAt(row.begins, t + 1e-3);
                                     return i < 0 ? '' : `${row.name}: ${row.bands[i].text}`;
                                   })
                                   .filter(Boolean)
                                   .join(' · ');
  }
}
