// Names over the scene, as elements: they stay sharp, and the more important one wins where two
// would overlap.

import {element} from './format.js';

const RANK = {
  collision: 0,
  abort: 1,
  near: 2,
  goal: 3
};
const OFFSET = 10;  // px from the mark

function overlap(a, b) {
  return a.left < b.right && a.right > b.left && a.top < b.bottom && a.bottom > b.top;
}

export class SceneLabels {
  constructor(host, marks) {
    this.labels = marks
                      .map((mark) => ({
                             mark,
                             point: new THREE.Vector3(...mark.position),
                             node: element('div', {class: `label ${mark.kind}`}, mark.text)
                           }))
                      .sort((a, b) => RANK[a.mark.kind] - RANK[b.mark.kind]);
    this.layer = element('div', {'aria-hidden': 'true'}, ...this.labels.map((label) => label.node));
    host.append(this.layer);
    this.isVisible = true;
  }

  place(camera, width, height) {
    this.layer.hidden = !this.isVisible;
    if (!this.isVisible) return;
    const taken = [];
    for (const {point, node} of this.labels) {
      const p = point.clone().project(camera);
      node.hidden = false;
      const isOutside = Math.abs(p.x) > 1 || Math.abs(p.y) > 1 || p.z > 1;
      const x = Math.min((p.x + 1) / 2 * width + OFFSET, width - node.offsetWidth);
      const y = Math.min((1 - p.y) / 2 * height - OFFSET, height - node.offsetHeight);
      const box = {left: x, top: y, right: x + node.offsetWidth, bottom: y + node.offsetHeight};
      node.hidden = isOutside || taken.some((other) => overlap(box, other));
      if (node.hidden) continue;
      node.style.transform = `translate(${x}px, ${y}px)`;
      taken.push(box);
    }
  }
}
