// What the objects of the scene are made of. Units are metres, in W: z is up.

import {colour, onThemeChange} from './theme.js';

/** Materials whose colours follow the theme, and line widths that follow the size of the view. */
export class Palette {
  constructor() {
    this.entries = [];
    this.lines = [];
    onThemeChange(() => this.apply());
  }

  add(material, name) {
    this.entries.push({material, name});
    material.color.set(colour(name));
    return material;
  }

  apply() {
    for (const {material, name} of this.entries) material.color.set(colour(name));
  }

  setSize(width, height) {
    for (const material of this.lines) material.resolution.set(width, height);
  }

  /** A translucent or opaque surface. */
  surface(name, opacity = 1) {
    return this.add(
        new THREE.MeshLambertMaterial(
            {transparent: opacity < 1, opacity, side: THREE.DoubleSide, depthWrite: opacity === 1}),
        name);
  }

  /** A line of `width` pixels. */
  line(name, width, {opacity = 1, dash = 0} = {}) {
    const material = new THREE.LineMaterial({linewidth: width});
    material.color = new THREE.Color();  // its own, because this type shares the default
    material.transparent = opacity < 1;
    material.uniforms.opacity.value = opacity;
    if (dash) {
      material.defines.USE_DASH = '';
      material.dashSize = dash;
      material.gapSize = 0.6 * dash;
      material.dashScale = 1;
    }
    this.lines.push(material);
    return this.add(material, name);
  }

  hairline(name, opacity) {
    return this.add(new THREE.LineBasicMaterial({transparent: opacity < 1, opacity}), name);
  }

  points(name, size) {
    return this.add(new THREE.PointsMaterial({size, sizeAttenuation: false}), name);
  }
}

/**
   The segments of a polyline x y z x y z ...; unknown points break it. `until[i]`: number of
    segments up to point i.
 */
export function segmentsOf(points) {
  const count = points.length / 3;
  const pairs = [];
  const until = new Uint32Array(count);
  let last = -1;
  for (let i = 0; i < count; ++i) {
    if (Number.isFinite(points[3 * i])) {
      if (last >= 0) {
        pairs.push(
            points[3 * last], points[3 * last + 1], points[3 * last + 2], points[3 * i],
            points[3 * i + 1], points[3 * i + 2]);
      }
      last = i;
    }
    until[i] = pairs.length / 6;
  }
  return {pairs: new Float32Array(pairs), until};
}

/** A polyline with a width in pixels. */
export class Polyline {
  constructor(material) {
    this.object = new THREE.LineSegments2(new THREE.LineSegmentsGeometry(), material);
    this.object.visible = false;
    this.object.frustumCulled = false;
  }

  setPoints(points) {
    const {pairs, until} = segmentsOf(points);
    this.until = until;
    this.object.geometry.dispose();
    this.object.visible = pairs.length > 0;
    if (!this.object.visible) return;
    this.object.geometry = new THREE.LineSegmentsGeometry();
    this.object.geometry.setPositions(pairs);
    if (this.object.material.defines.USE_DASH !== undefined) this.object.computeLineDistances();
  }

  /** Shows the part up to the i-th point only. */
  showUntil(i) {
    const count = i < 0 || !this.until ? 0 : this.until[Math.min(i, this.until.length - 1)];
    this.object.geometry.maxInstancedCount = count;
    this.object.visible = count > 0;
  }
}

/** A mesh {vertices, triangles} of the report. */
export function meshGeometry(mesh) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(mesh.vertices, 3));
  geometry.setIndex(new THREE.BufferAttribute(mesh.triangles, 1));
  const flat = geometry.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}

function capsuleGeometry(radius, length) {
  const profile = [];
  const steps = 8;
  for (let i = 0; i <= steps; ++i) {
    const angle = -Math.PI / 2 + (i / steps) * Math.PI / 2;
    profile.push(
        new THREE.Vector2(radius * Math.cos(angle), radius * Math.sin(angle) - length / 2));
  }
  for (let i = 0; i <= steps; ++i) {
    const angle = (i / steps) * Math.PI / 2;
    profile.push(
        new THREE.Vector2(radius * Math.cos(angle), radius * Math.sin(angle) + length / 2));
  }
  return new THREE.LatheBufferGeometry(profile, 24).rotateX(Math.PI / 2);
}

/** Geometry of a bounded primitive in its own frame; three.js's cylinders stand along y. */
export function primitiveGeometry(shape) {
  switch (shape.type) {
    case 'box':
      return new THREE.BoxBufferGeometry(...shape.size);
    case 'cylinder':
      return new THREE.CylinderBufferGeometry(shape.radius, shape.radius, shape.length, 32)
          .rotateX(Math.PI / 2);
    case 'sphere':
      return new THREE.SphereBufferGeometry(shape.radius, 32, 20);
    case 'capsule':
      return capsuleGeometry(shape.radius, shape.length);
    case 'ellipsoid':
      return new THREE.SphereBufferGeometry(1, 32, 20).scale(...shape.radii);
    default:
      return null;
  }
}

export function setPose(object, pose) {
  object.position.set(pose[0], pose[1], pose[2]);
  object.quaternion.set(pose[3], pose[4], pose[5], pose[6]);
}

/** The convex hull of points in any position, as a geometry. */
export function hullGeometry(points) {
  const hull = new THREE.ConvexHull().setFromPoints(points);
  const vertices = [];
  for (const face of hull.faces) {
    let edge = face.edge;
    do {
      const {x, y, z} = edge.head().point;
      vertices.push(x, y, z);
      edge = edge.next;
    } while (edge !== face.edge);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(vertices, 3));
  geometry.computeVertexNormals();
  return geometry;
}
