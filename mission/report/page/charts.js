// The charts of a dive.

import {BandChart, bandsOf} from './band_chart.js';
import {isKnown} from './data.js';
import {LineChart} from './line_chart.js';

const EVENT_MARKS = {
  transition: ['--true', d3.symbolTriangle, 0],
  failsafe: ['--required', d3.symbolSquare, 1],
  collision: ['--bad', d3.symbolStar, 1],
  operator: ['--exit', d3.symbolCross, 1],
};
const BANDS = ['var(--band-a)', 'var(--band-b)'];

function depths(positions) {
  const list = new Float32Array(positions.length / 3);
  for (let i = 0; i < list.length; ++i) list[i] = -positions[3 * i + 2];
  return list;
}

function statesChart(host, report, cursor, view) {
  const {samples, states, rungs, events, verdict, rerun_until_s: rerunUntil} = report.dive;
  const band = (name, textAt, colourOf = (text, index) => BANDS[index % 2]) =>
      ({name, bands: bandsOf(samples.t, verdict.duration_s, textAt), colourOf});
  const calm = (text) =>
      (text === 'none'     ? BANDS[0] :
           text === 'warn' ? BANDS[1] :
                             'var(--band-bad)');
  const rows = [
    band('State', (i) => states[samples.state[i]] || 'not started'),
    band('Failsafe', (i) => rungs[samples.rung[i]] || 'none', calm),
    band(
        'Above',
        (i) =>
            (samples.t[i] > rerunUntil ? 'not known' :
                 samples.overhead[i]   ? 'overhead' :
                                         'open water'),
        (text) => (text === 'overhead' ? BANDS[1] : BANDS[0]))
  ];
  const usesVision = samples.visual.some((value) => value > 0);
  if (usesVision)
    rows.push(band('Estimator', (i) => (samples.visual[i] > 0 ? 'visual-inertial' : 'primitive')));
  const marks = events.filter((event) => event.kind in EVENT_MARKS).map((event) => {
    const [colour, symbol] = EVENT_MARKS[event.kind];
    return {t: event.t, colour, symbol, name: `${event.what}\n${event.reason}`};
  });
  return new BandChart(host, cursor, view, {title: 'States', rows, marks});
}

function clearanceMarks({collisions, nearest}) {
  const marks = collisions.map(
      ({t, obstacle}) => ({t, value: 0, colour: '--bad', name: 'collision with ' + obstacle}));
  if (nearest) {
    const name = `least clearance ${nearest.clearance_m.toFixed(2)} m to ${nearest.obstacle}`;
    marks.push({t: nearest.t, value: nearest.clearance_m, colour: '--warn', name});
  }
  return marks;
}

/** Adds all charts to `host` and returns them. */
export function showCharts(host, report, cursor, view) {
  const {dive} = report;
  const {samples} = dive;
  const {has_truth: hasTruth} = dive.verdict;
  const required = {name: 'D_min', value: report.clearance_required_m, colour: '--required'};
  const common = {times: samples.t, maxGap: Math.max(10 * dive.sample_period_s, 1)};
  const line = (options) => new LineChart(host, cursor, view, {...common, ...options});
  const charts = [statesChart(host, report, cursor, view)];
  charts.push(line({
    title: 'Distance to the path',
    unit: 'm',
    digits: 2,
    limits: [required],
    goals: dive.local_goals,
    domain: [0, 0],
    description: 'Distance of the vehicle to the line between the last and the next local goal',
    series: [
      {name: 'true', values: samples.true_cross_track, colour: '--true'},
      {name: 'estimated', values: samples.cross_track, colour: '--estimated', kind: 'dashed'}
    ]
  }));
  charts.push(line({
    title: 'Clearance',
    unit: 'm',
    digits: 2,
    limits: [required],
    domain: [0, 0],
    ceiling: Math.max(5 * report.clearance_required_m, 2),
    marks: clearanceMarks(dive.verdict),
    series: [
      {
        name: hasTruth ? 'true, to the map' : 'of the estimate, to the map',
        values: samples.clearance,
        colour: hasTruth ? '--true' : '--estimated',
        kind: hasTruth ? '' : 'dashed'
      },
      {
        name: 'certified',
        values: samples.certified,
        colour: '--certified',
        kind: 'dotted',
        step: true
      }
    ]
  }));
  charts.push(line({
    title: 'Depth',
    unit: 'm',
    digits: 2,
    down: true,
    domain: [0, 0],
    limits: [{name: 'limit', value: report.max_depth_m, colour: '--required'}],
    series: [
      {name: 'true', values: depths(samples.true_position), colour: '--true'},
      {name: 'estimated', values: depths(samples.position), colour: '--estimated', kind: 'dashed'},
      {name: 'commanded', values: samples.command_depth, colour: '--certified', kind: 'dotted'}
    ]
  }));
  charts.push(line({
    title: 'Position uncertainty',
    unit: 'm',
    digits: 2,
    domain: [0, 0],
    series: [
      {name: 'true error', values: samples.error, colour: '--true'},
      {name: 'one sigma', values: samples.sigma, colour: '--estimated', kind: 'dashed'}
    ]
  }));
  charts.push(line({
    title: 'Speed',
    unit: 'm/s',
    digits: 2,
    domain: [0, 0],
    series: [
      {name: 'true', values: samples.true_speed, colour: '--true'},
      {name: 'estimated', values: samples.speed, colour: '--estimated', kind: 'dashed'}, {
        name: 'commanded',
        values: samples.command_speed,
        colour: '--certified',
        kind: 'dotted',
        step: true
      }
    ]
  }));
  if (samples.features.some(isKnown)) {
    charts.push(line({
      title: 'Features used by vision',
      unit: '',
      digits: 0,
      domain: [0, 0],
      series: [{name: 'features', values: samples.features, colour: '--estimated', step: true}]
    }));
  }
  charts.push(line({
    title: 'Battery',
    unit: '%',
    digits: 1,
    series: [{
      name: 'charge',
      values: samples.battery.map((value) => 100 * value),
      colour: '--true',
      step: true
    }]
  }));
  return charts;
}
