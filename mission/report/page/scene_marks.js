// What happened where: collisions, near misses, aborts, goals. Each has a name in the scene.

import {isKnown, lastIndexAt, pointAt} from './data.js';
import {clock, number} from './format.js';

const MAX_MARKS = 80;
const WAYPOINT_VALUES = 7;

function positionAt(samples, t) {
  const i = Math.max(lastIndexAt(samples.t, t + 1e-3), 0);
  const p = pointAt(samples.true_position, i);
  return isKnown(p[0]) ? p : pointAt(samples.position, i);
}

function contactMarks({verdict, near_misses: misses}) {
  const metres = (value) => number(value, 2, 'm');
  const marks = verdict.collisions.map(
      ({t, position, obstacle}) =>
          ({kind: 'collision', t, position, text: `collision: ${obstacle} at ${clock(t, 1)}`}));
  for (const {t, position, clearance_m: clearance, obstacle} of misses) {
    marks.push({kind: 'near', t, position, text: `near miss: ${metres(clearance)} to ${obstacle}`});
  }
  const {nearest} = verdict;
  const isMarked = nearest === null || nearest.clearance_m <= 0 ||
      misses.some((miss) => Math.abs(miss.t - nearest.t) < 2);
  if (!isMarked) {
    const text = `least clearance: ${metres(nearest.clearance_m)} to ${nearest.obstacle}`;
    marks.push({kind: 'near', t: nearest.t, position: nearest.position, text});
  }
  return marks;
}

/** Where the executive took over from the mission. */
function abortMarks({transitions, samples}) {
  return transitions.filter(({from, to}) => to.startsWith('dive.') && !from.startsWith('dive.'))
      .map(({t, to}) => ({
             kind: 'abort',
             t,
             position: positionAt(samples, t),
             text: `${to} at ${clock(t, 1)}`
           }));
}

/** The ends of the accepted paths: one for each goal. */
function goalMarks(paths) {
  const goals = new Map();
  for (const {accepted, goal, waypoints} of paths) {
    if (!accepted || waypoints.length === 0 || !goal) continue;
    const position = Array.from(waypoints.slice(-WAYPOINT_VALUES).subarray(0, 3));
    goals.set(goal, {kind: 'goal', t: null, text: goal, position});
  }
  return [...goals.values()];
}

function marksOf({dive, paths}) {
  const marks = dive ? [...contactMarks(dive), ...abortMarks(dive)] : [];
  return [...marks.filter((mark) => isKnown(mark.position[0])), ...goalMarks(paths)].slice(
      0, MAX_MARKS);
}

export class SceneMarks {
  constructor(report, palette) {
    this.object = new THREE.Group();
    this.list = marksOf(report);
    const colours = {collision: '--bad', near: '--warn', abort: '--exit', goal: '--planned'};
    const geometries = {
      collision: new THREE.SphereBufferGeometry(0.16, 16, 12),
      near: new THREE.OctahedronBufferGeometry(0.13),
      abort: new THREE.OctahedronBufferGeometry(0.18),
      goal: new THREE.SphereBufferGeometry(0.09, 12, 8),
    };
    const materials =
        new Map(Object.entries(colours).map(([kind, name]) => [kind, palette.surface(name)]));
    for (const mark of this.list) {
      const mesh = new THREE.Mesh(geometries[mark.kind], materials.get(mark.kind));
      mesh.position.set(...mark.position);
      this.object.add(mesh);
    }
  }
}
