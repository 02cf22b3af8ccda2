// The vehicle at the cursor: where it was, where it was estimated to be with the ellipsoid that
// contains the truth with 95 %, its track, trail and exit path.

import {lastIndexAt, pointAt} from './data.js';
import {meshGeometry, Polyline} from './scene_shapes.js';

const UNIT = 32767;                  // of quaternions as 16-bit integers
const SIGMAS_OF_95_PERCENT = 2.796;  // sqrt of the 95 % quantile of chi-squared with 3 degrees

class Body {
  constructor(geometry, material, edges) {
    this.object = new THREE.Mesh(geometry, material);
    this.object.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 30), edges));
  }

  /** Returns false where there is no pose. */
  place(positions, attitudes, i) {
    this.object.visible = i >= 0 && Number.isFinite(positions[3 * i]);
    if (!this.object.visible) return false;
    this.object.position.set(...pointAt(positions, i));
    this.object.quaternion
        .set(
            attitudes[4 * i] / UNIT, attitudes[4 * i + 1] / UNIT, attitudes[4 * i + 2] / UNIT,
            attitudes[4 * i + 3] / UNIT)
        .normalize();
    return true;
  }
}

export class SceneVehicle {
  constructor(report, palette) {
    this.dive = report.dive;
    const {samples, trail} = this.dive;
    this.object = new THREE.Group();
    const geometry = meshGeometry(report.hull.mesh);
    this.trueBody = new Body(geometry, palette.surface('--true'), palette.hairline('--paper', 1));
    this.estimatedBody = new Body(
        geometry, palette.surface('--estimated', 0.35), palette.hairline('--estimated', 1));
    this.ellipsoid = new THREE.Mesh(
        new THREE.SphereBufferGeometry(1, 24, 16), palette.surface('--estimated', 0.18));
    this.ellipsoid.add(new THREE.LineSegments(
        new THREE.WireframeGeometry(new THREE.SphereBufferGeometry(1, 12, 8)),
        palette.hairline('--estimated', 0.5)));
    this.ellipsoid.matrixAutoUpdate = false;
    this.tracks = {
      true: this.track(
          samples.true_position, palette.line('--true', 4),
          palette.line('--true', 1.5, {opacity: 0.5})),
      estimated: this.track(
          samples.position, palette.line('--estimated', 3, {dash: 0.25}),
          palette.line('--estimated', 1.2, {opacity: 0.45})),
    };
    this.breadcrumbs = new THREE.Points(new THREE.BufferGeometry(), palette.points('--trail', 5));
    this.breadcrumbs.frustumCulled = false;
    this.breadcrumbs.geometry.setAttribute('position', new THREE.BufferAttribute(trail.points, 3));
    this.exit = new Polyline(palette.line('--exit', 4));
    this.exitIndex = -2;
    this.exitTimes = this.dive.exits.map((exit) => exit.t);
    this.estimate = new THREE.Group();
    this.estimate.add(this.estimatedBody.object, this.ellipsoid);
    this.object.add(
        this.trueBody.object, this.estimate, this.tracks.true.group, this.tracks.estimated.group,
        this.breadcrumbs, this.exit.object);
  }

  track(points, past, whole) {
    const lines = {past: new Polyline(past), whole: new Polyline(whole)};
    lines.past.setPoints(points);
    lines.whole.setPoints(points);
    lines.group = new THREE.Group();
    lines.group.add(lines.whole.object, lines.past.object);
    return lines;
  }

  /** Shows the time t; `i` is its sample. */
  show(t, i) {
    const {samples} = this.dive;
    this.trueBody.place(samples.true_position, samples.true_attitude, i);
    const hasEstimate = this.estimatedBody.place(samples.position, samples.attitude, i);
    this.placeEllipsoid(hasEstimate ? i : -1);
    this.tracks.true.past.showUntil(i);
    this.tracks.estimated.past.showUntil(i);
    this.breadcrumbs.geometry.setDrawRange(0, lastIndexAt(this.dive.trail.t, t) + 1);
    this.showExit(t, i);
  }

  placeEllipsoid(i) {
    const factor = this.dive.samples.ellipsoid;
    this.ellipsoid.visible = i >= 0 && factor[6 * i] > 0;
    if (!this.ellipsoid.visible) return;
    const [a, b, c, d, e, f] =
        Array.from(factor.subarray(6 * i, 6 * i + 6), (value) => SIGMAS_OF_95_PERCENT * value);
    const [x, y, z] = pointAt(this.dive.samples.position, i);
    this.ellipsoid.matrix.set(a, 0, 0, x, b, c, 0, y, d, e, f, z, 0, 0, 0, 1);
    this.ellipsoid.matrixWorldNeedsUpdate = true;
  }

  // In open water straight up, else back along the trail and then up.
  showExit(t, i) {
    const index = t > this.dive.rerun_until_s + 0.1 ? -1 : lastIndexAt(this.exitTimes, t);
    const exit = this.dive.exits[index];
    const points = [];
    if (exit && i >= 0 && Number.isFinite(this.dive.samples.position[3 * i])) {
      points.push(...pointAt(this.dive.samples.position, i));
      if (!exit.open_above) points.push(...exit.points);
      const last = points.slice(-3);
      if (exit.open_above || exit.points.length) points.push(last[0], last[1], 0);
    }
    this.exit.setPoints(points);
  }
}
