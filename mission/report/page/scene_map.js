// The map: primitives, meshes, half-spaces, and the surface of the sea.

import {meshGeometry, primitiveGeometry, setPose} from './scene_shapes.js';

const EDGE_ANGLE = 25;  // degrees: edges that are less sharp are not drawn
const MAX_EDGE_TRIANGLES = 60000;
const OPACITY = 0.32;

export class SceneMap {
  /**
   * `region`: the box of everything that moved, from which half-spaces and sea get their extent.
   */
  constructor(map, palette, region) {
    this.object = new THREE.Group();
    this.sea = new THREE.Group();
    this.pickable = [];
    this.palette = palette;
    this.solid = palette.surface('--solid', OPACITY);
    this.edges = palette.hairline('--edge', 0.9);
    this.region = region;
    for (const shape of map.shapes) this.addShape(shape);
    if (map.mesh.triangles.length) this.addMesh(map.mesh);
    this.addSea();
  }

  addShape(shape) {
    const geometry = primitiveGeometry(shape);
    if (geometry === null) {
      this.addHalfSpace(shape);
      return;
    }
    const mesh = new THREE.Mesh(geometry, this.solid);
    setPose(mesh, shape.pose);
    mesh.userData.nameOf = () => shape.name;
    mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry, EDGE_ANGLE), this.edges));
    this.object.add(mesh);
    this.pickable.push(mesh);
  }

  addMesh(data) {
    const geometry = meshGeometry(data);
    const mesh = new THREE.Mesh(geometry, this.solid);
    const ends = [];
    for (const part of data.parts) ends.push((ends[ends.length - 1] ?? 0) + part.triangles);
    mesh.userData.nameOf = (face) => data.parts[ends.findIndex((end) => face < end)]?.name ?? '';
    if (data.triangles.length / 3 <= MAX_EDGE_TRIANGLES) {
      mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry, EDGE_ANGLE), this.edges));
    }
    this.object.add(mesh);
    this.pickable.push(mesh);
  }

  size() {
    return this.region.getSize(new THREE.Vector3()).length() + 10;
  }

  // A square of its boundary, about the middle of the region.
  addHalfSpace(shape) {
    const pose = new THREE.Object3D();
    setPose(pose, shape.pose);
    const normal = new THREE.Vector3(...shape.normal).applyQuaternion(pose.quaternion);
    const centre = this.region.getCenter(new THREE.Vector3());
    centre.addScaledVector(normal, -normal.dot(centre.clone().sub(pose.position)));
    const size = 1.5 * this.size();
    const mesh = new THREE.Mesh(new THREE.PlaneBufferGeometry(size, size), this.solid);
    mesh.position.copy(centre);
    mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), normal);
    mesh.userData.nameOf = () => shape.name;
    mesh.add(this.grid(size, this.edges));
    this.object.add(mesh);
    this.pickable.push(mesh);
  }

  /** Lines in the xy plane, 1, 5, 25 ... m apart. */
  grid(size, material) {
    let step = 1;
    while (size / step > 40) step *= 5;
    const half = Math.ceil(size / 2 / step) * step;
    const points = [];
    for (let at = -half; at <= half; at += step) {
      points.push(-half, at, 0, half, at, 0, at, -half, 0, at, half, 0);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(points, 3));
    return new THREE.LineSegments(geometry, material);
  }

  addSea() {
    const size = this.region.getSize(new THREE.Vector3()).length() + 2;
    const centre = this.region.getCenter(new THREE.Vector3());
    this.sea.position.set(Math.round(centre.x), Math.round(centre.y), 0);
    this.sea.add(new THREE.Mesh(
        new THREE.PlaneBufferGeometry(size, size), this.palette.surface('--sea', 0.1)));
    this.sea.add(this.grid(size, this.palette.hairline('--sea', 0.35)));
    this.object.add(this.sea);
  }
}
