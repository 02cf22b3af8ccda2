// Planned paths: lines, waypoints, and the hull swept along the path of the moment.

import {hullGeometry, Polyline} from './scene_shapes.js';

const VALUES = 7;  // of a waypoint: x y z qx qy qz qw

function positionsOf(waypoints) {
  const list = [];
  for (let i = 0; i < waypoints.length; i += VALUES)
    list.push(waypoints[i], waypoints[i + 1], waypoints[i + 2]);
  return list;
}

/** The outline of the hull at the i-th waypoint, in W. */
function placedOutline(outline, waypoints, i) {
  const at = VALUES * i;
  const position = new THREE.Vector3(waypoints[at], waypoints[at + 1], waypoints[at + 2]);
  const attitude = new THREE.Quaternion(
      waypoints[at + 3], waypoints[at + 4], waypoints[at + 5], waypoints[at + 6]);
  const points = [];
  for (let k = 0; k < outline.length; k += 3) {
    points.push(new THREE.Vector3(outline[k], outline[k + 1], outline[k + 2])
                    .applyQuaternion(attitude)
                    .add(position));
  }
  return points;
}

/** The convex hull of the vehicle at each two consecutive waypoints, which is what is certified. */
function sweepGeometries(outline, waypoints) {
  const count = waypoints.length / VALUES;
  const geometries = [];
  for (let i = 1; i < count; ++i) {
    geometries.push(hullGeometry(
        [...placedOutline(outline, waypoints, i - 1), ...placedOutline(outline, waypoints, i)]));
  }
  return geometries;
}

export class ScenePaths {
  constructor(report, palette) {
    this.report = report;
    this.object = new THREE.Group();
    this.others = new THREE.Group();  // every path, thin
    this.sweep = new THREE.Group();
    this.object.add(this.others, this.sweep);
    this.sweepMaterial = palette.surface('--planned', 0.2);
    this.sweepEdges = palette.hairline('--planned', 0.45);
    this.current = new Polyline(palette.line('--planned', 3.5));
    this.waypoints = new THREE.Points(new THREE.BufferGeometry(), palette.points('--planned', 7));
    this.waypoints.frustumCulled = false;
    this.object.add(this.current.object, this.waypoints);
    this.shownPath = null;
    const thin = palette.line('--planned', 1.5, {opacity: 0.45});
    for (const path of report.paths) {
      if (!path.accepted) continue;
      const line = new Polyline(thin);
      line.setPoints(positionsOf(path.waypoints));
      this.others.add(line.object);
    }
  }

  /** Shows one path with its sweep; all of them for index 'all', none for -1. */
  show(index) {
    if (index === this.shownPath) return;
    this.shownPath = index;
    const shown = index === 'all' ? this.report.paths : [this.report.paths[index]].filter(Boolean);
    for (const child of this.sweep.children.slice()) {
      this.sweep.remove(child);
      child.geometry.dispose();
    }
    const points = [];
    for (const path of shown) {
      const positions = positionsOf(path.waypoints);
      if (points.length) points.push(NaN, NaN, NaN);
      points.push(...positions);
      for (const geometry of sweepGeometries(this.report.hull.outline, path.waypoints)) {
        const mesh = new THREE.Mesh(geometry, this.sweepMaterial);
        mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 35), this.sweepEdges));
        this.sweep.add(mesh);
      }
    }
    this.current.setPoints(points);
    const known = points.filter(Number.isFinite);
    this.waypoints.geometry.dispose();
    this.waypoints.geometry = new THREE.BufferGeometry();
    this.waypoints.geometry.setAttribute('position', new THREE.Float32BufferAttribute(known, 3));
    this.waypoints.visible = known.length > 0;
  }
}
