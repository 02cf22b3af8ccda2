// What happened where: collisions, near misses, aborts, goals. Each has a name in the scene.

import {isKnown, lastIndexAt, pointAt} from './data.js';
import {clock} from './format.js';

const MAX_MARKS = 60;
const GOAL_VALUES = 7;

function positionAt(samples, t) {
  const i = Math.max(lastIndexAt(samples.t, t + 1e-3), 0);
  const p = pointAt(samples.true_position, i);
  return isKnown(p[0]) ? p : pointAt(samples.position, i);
}

function diveMarks(dive) {
  const marks = [];
  for (const collision of dive.verdict.collisions) {
    marks.push({kind: 'collision', t: collision.t, position: collision.position, text: `collision: ${collision.obstacle} at ${clock(collision.t, 1)}`});
  }
  for (const miss of dive.near_misses) {
    marks.push({kind: 'near', t: miss.t, position: miss.position, text: `near miss: ${miss.clearance_m.toFixed(2)} m to ${miss.obstacle}`});
  }
  const {nearest} = dive.verdict;
  if (nearest && nearest.clearance_m > 0 && !dive.near_misses.some((miss) => Math.abs(miss.t - nearest.t) < 2)) {
    marks.push({kind: 'near', t: nearest.t, position: nearest.position, text: `least clearance: ${nearest.clearance_m.toFixed(2)} m to ${nearest.obstacle}`});
  }
  for (const transition of dive.transitions) {
    if (!/^dive\.(retrace|abort|emergency)/.test(transition.to) || /^dive\./.test(transition.from)) continue;
    marks.push({kind: 'abort', t: transition.t, position: positionAt(dive.samples, transition.t), text: `${transition.to} at ${clock(transition.t, 1)}`});
  }
  return marks.filter((mark) => isKnown(mark.position[0])).slice(0, MAX_MARKS);
}

/** The ends of the accepted paths: one for each goal. */
function goalMarks(paths) {
  const goals = new Map();
  for (const path of paths) {
    const count = path.waypoints.length;
    if (!path.accepted || count === 0 || !path.goal) continue;
    goals.set(path.goal, {kind: 'goal', t: null, text: path.goal, position: Array.from(path.waypoints.slice(count - GOAL_VALUES, count - GOAL_VALUES + 3))});
  }
  return [...goals.values()].slice(0, MAX_MARKS);
}

export class SceneMarks {
  constructor(report, palette) {
    this.object = new THREE.Group();
    this.list = [...(report.dive ? diveMarks(report.dive) : []), ...goalMarks(report.paths)];
    const colours = {collision: '--bad', near: '--warn', abort: '--exit', goal: '--planned'};
    const geometries = {collision: new THREE.SphereBufferGeometry(0.16, 16, 12), near: new THREE.OctahedronBufferGeometry(0.13),
                        abort: new THREE.OctahedronBufferGeometry(0.18), goal: new THREE.SphereBufferGeometry(0.09, 12, 8)};
    const materials = new Map(Object.entries(colours).map(([kind, name]) => [kind, palette.surface(name)]));
    for (const mark of this.list) {
      const mesh = new THREE.Mesh(geometries[mark.kind], materials.get(mark.kind));
      mesh.position.set(...mark.position);
      this.object.add(mesh);
    }
  }
}
