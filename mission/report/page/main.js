// Puts the page together.

import {showCharts} from './charts.js';
import {TimeCursor, TimeView} from './cursor.js';
import {readReport} from './data.js';
import {EventList} from './event_list.js';
import {element} from './format.js';
import {PathTable} from './path_table.js';
import {Scene} from './scene.js';
import {collectErrors, runSelfTest} from './self_test.js';
import {followDevice} from './theme.js';
import {themeButton, TimeBar} from './time_bar.js';
import {showVerdict} from './verdict.js';

const MIN_DURATION = 0.02;  // s: a log of one tick

function showAbout(host, report) {
  const {dive} = report;
  const texts =
      ['Positions are in metres, x east, y north, z up; the surface is z = 0. ' +
       'Times count from the beginning of the dive.'];
  if (dive) {
    texts.push(
        `Curves and tracks have one sample in ${dive.sample_period_s.toFixed(2)} s ` +
        `(${dive.samples.t.length} in all) and one at every transition, new local goal and ` +
        'contact; times, values and places of collisions, least clearance and events are exact.');
    texts.push(
        'Clearance is measured from the hull to the map. Objects of a simulated world lie a ' +
        'little off the map, and the least clearance above is that to the simulated world. ' +
        'A near miss is closer than half of D_min, without contact.');
  }
  if (dive && dive.observed.pieces < dive.observed.all_pieces) {
    texts.push(`Of the ${dive.observed.all_pieces} pieces of the observed map ${
        dive.observed.pieces} are drawn.`);
  }
  const keys = [
    ['←', 'one second back'], ['→', 'one second on'], ['Shift', 'with an arrow: ten seconds'],
    [', .', 'a tenth of a second'], ['N P', 'next, previous event'], ['Space', 'play or pause'],
    ['Home End', 'begin, end'], ['T', 'theme']
  ];
  host.append(...texts.map((text) => element('p', {}, text)));
  if (dive) {
    host.append(element(
        'p', {}, 'Keys: ',
        ...keys.flatMap(([key, what], i) => [i ? '; ' : '', element('kbd', {}, key), ' ' + what]),
        '.'));
  }
  host.append(element(
      'details', {},
      element(
          'summary', {},
          'SHA-256 of the files as they were used, a mission with its fragments inserted'),
      ...report.files.map(
          (file) =>
              element('p', {}, `${file.role} ${file.name}: `, element('code', {}, file.sha256)))));
  host.append(element(
      'details', {}, element('summary', {}, 'three.js and D3 are in this file; their licences'),
      element('pre', {}, document.getElementById('licences').textContent)));
  host.append(element('p', {}, 'This page is one file. It fetches nothing.'));
}

/**
 * Where the cursor begins: the first collision, or else the first abort, or else the least
 * clearance.
 */
function firstMoment(dive) {
  const abort = dive.transitions.find((transition) => /^dive\./.test(transition.to));
  return (dive.verdict.collisions[0] ?? abort ?? dive.verdict.nearest ?? {t: 0}).t;
}

function main() {
  const find = (id) => document.getElementById(id);
  collectErrors();
  followDevice();
  const report = readReport();
  const {dive} = report;
  document.body.classList.toggle('plan-only', dive === null);
  const cursor = new TimeCursor(Math.max(dive ? dive.verdict.duration_s : 0, MIN_DURATION));
  showVerdict(find('verdict'), report, cursor);
  showAbout(find('about'), report);
  const views = {};
  if (dive) {
    const view = new TimeView(cursor);
    const times = [...new Set(dive.events.map((event) => event.t))].sort((a, b) => a - b);
    views.time_bar = new TimeBar(find('time-bar'), cursor, view, times);
    showCharts(find('charts'), report, cursor, view).forEach((chart, i) => {
      views['chart_' + i] = chart;
    });
    views.events = new EventList(find('events'), dive.events, cursor);
  } else {
    find('about').prepend(themeButton());
  }
  const scene = new Scene(find('scene'), report, cursor);
  const paths = new PathTable(find('paths'), report, cursor, (index) => {
    if (!dive && scene.isDrawn) {
      scene.paths.show(index);
      scene.render();
    }
  });
  if (dive && report.paths.length > 1) views.paths = paths;
  if (dive) cursor.set(firstMoment(dive));
  const drawScene = () => {
    const openedMs = Math.round(performance.now());
    scene.start();
    if (dive && scene.isDrawn) views.scene = scene;
    if (location.hash !== '#selftest') return;
    if (scene.isDrawn) scene.draw();
    runSelfTest(views, scene, cursor, openedMs, Math.round(performance.now()));
  };
  // The verdict and the charts are shown first.
  requestAnimationFrame(() => setTimeout(drawScene, 0));
}

main();
