// The 3-D scene. Without WebGL it says so, and the rest of the page works.

import {isKnown, lastIndexAt, pointAt} from './data.js';
import {clock, element, number, swatch} from './format.js';
import {SceneLabels} from './scene_labels.js';
import {SceneMap} from './scene_map.js';
import {SceneMarks} from './scene_marks.js';
import {ScenePaths} from './scene_paths.js';
import {meshGeometry, Palette} from './scene_shapes.js';
import {SceneVehicle} from './scene_vehicle.js';
import {colour, onThemeChange} from './theme.js';

const CLICK = 5;        // px that a click may move
const NEAR_TRACK = 16;  // px from the track that still select it

/** The box of everything that moved or was planned. */
function regionOf(report) {
  const box = new THREE.Box3();
  const include = (list, stride) => {
    for (let i = 0; i + 2 < list.length; i += stride) {
      if (Number.isFinite(list[i]))
        box.expandByPoint(new THREE.Vector3(list[i], list[i + 1], list[i + 2]));
    }
  };
  if (report.dive) {
    include(report.dive.samples.true_position, 3);
    include(report.dive.samples.position, 3);
  }
  for (const path of report.paths) include(path.waypoints, 7);
  if (box.isEmpty()) box.expandByPoint(new THREE.Vector3(0, 0, -3));
  return box.expandByScalar(1);
}

function makeRenderer() {
  try {
    return new THREE.WebGLRenderer({antialias: true});
  } catch (error) {
    return null;
  }
}

export class Scene {
  constructor(host, report, cursor) {
    this.host = host;
    this.report = report;
    this.cursor = cursor;
    this.view = element('div', {class: 'view'});
    host.append(this.view);
    this.renderer = null;
  }

  /** Draws the scene. Takes a second or more where no graphics processor helps. */
  start() {
    const {report, cursor} = this;
    // three.js reports a missing WebGL as an error of the page; it is none.
    const probe = document.createElement('canvas');
    const hasWebGl = Boolean(probe.getContext('webgl') || probe.getContext('experimental-webgl'));
    this.renderer = hasWebGl ? makeRenderer() : null;
    if (this.renderer === null) {
      this.view.append(element(
          'p', {class: 'readout', id: 'no-webgl'},
          'This browser has no WebGL, so that the 3-D scene cannot be drawn. ' +
              'Everything else on this page works; ' +
              'dive run --svg draws the dive from above and from the side.'));
      return;
    }
    this.build();
    this.addControls();
    this.addLayers();
    new ResizeObserver(() => this.resize()).observe(this.view);
    this.resize();
    this.fit();
    onThemeChange(() => this.render());
    if (report.dive)
      cursor.subscribe((t) => this.move(t));
    else
      this.paths.show('all');
  }

  get isDrawn() {
    return this.renderer !== null;
  }

  build() {
    const {report} = this;
    this.palette = new Palette();
    this.region = regionOf(report);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.05, 5000);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8899aa, 0.9));
    const sun = new THREE.DirectionalLight(0xffffff, 0.45);
    sun.position.set(-2, -3, 5);
    this.scene.add(sun);
    this.map = new SceneMap(report.map, this.palette, this.region);
    this.paths = new ScenePaths(report, this.palette);
    this.marks = new SceneMarks(report, this.palette);
    this.scene.add(this.map.object, this.paths.object, this.marks.object);
    if (report.dive) {
      this.vehicle = new SceneVehicle(report, this.palette);
      this.scene.add(this.vehicle.object);
      this.addObserved(report.dive.observed);
    }
    const canvas = this.renderer.domElement;
    canvas.setAttribute('role', 'img');
    canvas.setAttribute(
        'aria-label',
        'Map and tracks in three dimensions; drag to turn, wheel or two fingers to zoom');
    this.view.append(canvas);
    this.labels = new SceneLabels(this.view, this.marks.list);
    this.readout = element('div', {class: 'readout', id: 'scene-readout'});
    this.picked = element('div', {class: 'readout picked', 'aria-live': 'polite'});
    this.view.append(this.readout, this.picked);
  }

  addObserved(observed) {
    if (observed.triangles.length === 0) return;
    this.observedTimes = observed.t;
    this.observed =
        new THREE.Mesh(meshGeometry(observed), this.palette.surface('--observed', 0.75));
    this.observed.frustumCulled = false;
    this.scene.add(this.observed);
  }

  addControls() {
    const canvas = this.renderer.domElement;
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.enableKeys = false;  // arrow keys move the time cursor
    this.controls.screenSpacePanning = true;
    this.controls.addEventListener('change', () => this.render());
    this.controls.addEventListener('start', () => {
      this.direction = null;
    });
    let down = null;
    canvas.addEventListener('pointerdown', (event) => {
      down = [event.clientX, event.clientY];
    });
    canvas.addEventListener('pointerup', (event) => {
      if (down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < CLICK)
        this.click(event);
      down = null;
    });
    const button = (text, title, onclick) =>
        element('button', {type: 'button', title, onclick}, text);
    this.followButton =
        button('Follow', 'Keep the vehicle in the middle', () => this.setFollow(!this.isFollowing));
    this.followButton.setAttribute('aria-pressed', 'false');
    this.host.append(element(
        'div', {class: 'buttons', role: 'group', 'aria-label': 'View'},
        button('Fit', 'Show everything', () => this.fit()),
        button('Top', 'From above, north up', () => this.look(0, 0, 1)),
        button('South', 'From the south', () => this.look(0, -1, 0.02)),
        button('West', 'From the west', () => this.look(-1, 0, 0.02)),
        this.report.dive ? this.followButton : null));
  }

  addLayers() {
    const layers = [
      ['Map', [this.map.object], '--solid', 'fill'], ['Surface', [this.map.sea], '--sea', 'fill'],
      ['Plan and swept hull', [this.paths.object], '--planned', ''],
      ['All plans', [this.paths.others], '--planned', 'dotted']
    ];
    if (this.report.dive) {
      const {vehicle} = this;
      if (this.report.dive.verdict.has_truth) {
        layers.push(
            ['True track', [vehicle.tracks.true.group, vehicle.trueBody.object], '--true', '']);
      }
      layers.push(
          [
            'Estimate, 95 %', [vehicle.tracks.estimated.group, vehicle.estimate], '--estimated',
            'dashed'
          ],
          ['Trail', [vehicle.breadcrumbs], '--trail', 'dotted'],
          ['Exit path', [vehicle.exit.object], '--exit', '']);
      if (this.observed) layers.push(['Observed', [this.observed], '--observed', 'fill']);
    }
    this.hidden = new Set();
    this.switches =
        layers.map(([name, objects, style, kind]) => this.layerSwitch(name, objects, style, kind));
    const names = element('input', {
      type: 'checkbox',
      checked: true,
      onchange: () => {
        this.labels.isVisible = names.checked;
        this.render();
      }
    });
    this.host.append(element(
        'details', {open: matchMedia('(min-width: 40rem)').matches},
        element('summary', {}, 'Layers'),
        element(
            'div', {class: 'layers', role: 'group', 'aria-label': 'Layers'}, ...this.switches,
            element('label', {}, names, 'Names'))));
    if (this.report.dive && this.report.paths.length > 6)
      this.switches[3].querySelector('input').click();
  }

  // Layers, because visibility is also switched by the cursor.
  layerSwitch(name, objects, style, kind) {
    const box = element('input', {
      type: 'checkbox',
      checked: true,
      onchange: () => {
        for (const object of objects) {
          object.traverse((child) => child.layers.set(box.checked ? 0 : 1));
          if (box.checked)
            this.hidden.delete(object);
          else
            this.hidden.add(object);
        }
        for (const object of this.hidden) object.traverse((child) => child.layers.set(1));
        this.render();
      }
    });
    return element('label', {}, box, swatch(style, kind), name);
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.view;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.palette.setSize(width, height);
    if (this.direction) this.look(...this.direction);
    this.render();
  }

  /** What to fit: everything that moved, and of the map what is near. */
  fitBox() {
    const box = this.region.clone();
    const reach = this.region.clone().expandByVector(
        this.region.getSize(new THREE.Vector3()).multiplyScalar(0.15));
    reach.max.z = Math.min(reach.max.z, 0.2);
    for (const mesh of this.map.pickable) {
      if (mesh.geometry.type === 'PlaneBufferGeometry') continue;
      const near = new THREE.Box3().setFromObject(mesh).intersect(reach);
      if (!near.isEmpty()) box.union(near);
    }
    return box;
  }

  fit() {
    this.look(-0.45, -0.8, 0.5);
  }

  /** Looks at the middle from a direction, as near as the whole box allows. */
  look(x, y, z) {
    this.direction = [x, y, z];  // until the camera is moved by hand
    const box = this.fitBox();
    const centre = box.getCenter(new THREE.Vector3());
    const radius = box.getSize(new THREE.Vector3()).length() / 2;
    // Straight down, north is up.
    const direction = new THREE.Vector3(x, x === 0 && y === 0 ? -1e-3 : y, z).normalize();
    const right = new THREE.Vector3(0, 0, 1).cross(direction).normalize();
    const up = direction.clone().cross(right);
    const tangent = Math.tan(THREE.Math.degToRad(this.camera.fov / 2));
    let distance = 0;
    for (let i = 0; i < 8; ++i) {
      const corner = new THREE
                         .Vector3(
                             i & 1 ? box.min.x : box.max.x, i & 2 ? box.min.y : box.max.y,
                             i & 4 ? box.min.z : box.max.z)
                         .sub(centre);
      const half =
          Math.max(Math.abs(corner.dot(up)), Math.abs(corner.dot(right)) / this.camera.aspect);
      distance = Math.max(distance, corner.dot(direction) + half / tangent);
    }
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(direction, 1.03 * distance);
    this.camera.near = radius / 200;
    this.camera.far = 200 * radius;
    this.camera.updateProjectionMatrix();
    this.setFollow(false);
    this.controls.update();
  }

  setFollow(isFollowing) {
    this.isFollowing = isFollowing;
    this.followButton.setAttribute('aria-pressed', String(isFollowing));
    if (isFollowing) this.move(this.cursor.time);
  }

  vehiclePosition(i) {
    const {samples} = this.report.dive;
    const p = pointAt(samples.true_position, i);
    return isKnown(p[0]) ? p : pointAt(samples.position, i);
  }

  move(t) {
    const {samples} = this.report.dive;
    // Before its first sample the vehicle is shown where that has it.
    const i = Math.max(lastIndexAt(samples.t, t + 1e-3), 0);
    this.vehicle.show(t, i);
    this.paths.show(samples.path[i]);
    if (this.observed)
      this.observed.geometry.setDrawRange(0, 3 * (lastIndexAt(this.observedTimes, t) + 1));
    for (const object of this.hidden) object.traverse((child) => child.layers.set(1));
    this.showReadout(t, i);
    if (this.isFollowing) this.centreOn(this.vehiclePosition(i));
    this.render();
  }

  centreOn(p) {
    if (!isKnown(p[0])) return;
    this.direction = null;
    const shift = new THREE.Vector3(...p).sub(this.controls.target);
    this.controls.target.add(shift);
    this.camera.position.add(shift);
    this.controls.update();
  }

  showReadout(t, i) {
    const {samples, states} = this.report.dive;
    const depth = -this.vehiclePosition(i)[2];
    this.readout.textContent = [
      `${clock(t, 1)}  ${states[samples.state[i]] || ''}`, `depth ${number(depth, 2, 'm')}`,
      isKnown(samples.error[i]) ? `error ${number(samples.error[i], 2, 'm')}` : null,
      isKnown(samples.sigma[i]) ? `one sigma ${number(samples.sigma[i], 2, 'm')}` : null
    ].filter(Boolean).join('\n');
  }

  /** A click on the track moves the cursor there; on an object it shows its name. */
  click(event) {
    const box = this.renderer.domElement.getBoundingClientRect();
    const x = event.clientX - box.left;
    const y = event.clientY - box.top;
    const i = this.report.dive ? this.sampleAt(x, y, box) : -1;
    if (i >= 0) {
      this.cursor.set(this.report.dive.samples.t[i]);
      return;
    }
    const ray = new THREE.Raycaster();
    ray.setFromCamera(
        new THREE.Vector2(2 * x / box.width - 1, 1 - 2 * y / box.height), this.camera);
    const hit = ray.intersectObjects(this.map.pickable, false)[0];
    this.picked.textContent = hit ? hit.object.userData.nameOf(hit.faceIndex) : '';
  }

  sampleAt(x, y, box) {
    const {samples} = this.report.dive;
    let best = -1;
    let least = NEAR_TRACK;
    for (let i = 0; i < samples.t.length; ++i) {
      const p = this.vehiclePosition(i);
      if (!isKnown(p[0])) continue;
      const q = new THREE.Vector3(...p).project(this.camera);
      const distance = Math.hypot((q.x + 1) / 2 * box.width - x, (1 - q.y) / 2 * box.height - y);
      if (q.z < 1 && distance < least) [best, least] = [i, distance];
    }
    return best;
  }

  /** Draws once in the next frame, so that a page at rest costs no charge. */
  render() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.isDue = false;
    this.renderer.setClearColor(new THREE.Color(colour('--scene')));
    this.renderer.render(this.scene, this.camera);
    this.labels.place(this.camera, this.view.clientWidth, this.view.clientHeight);
  }

  shown() {
    if (!this.isDrawn || !this.vehicle) return '';
    const p = this.vehicle.estimatedBody.object.position;
    return [p.x, p.y, p.z].join(' ') + this.readout.textContent;
  }
}
