// The page's own test, run where its address ends with #selftest: moves the cursor and writes into
// the page which views followed. test/mission/report/browser_test.cpp reads it.

import {element} from './format.js';

const errors = [];

/** To be called first: errors from then on are part of the result. */
export function collectErrors() {
  addEventListener('error', (event) => errors.push(String(event.message)));
  addEventListener('unhandledrejection', (event) => errors.push(String(event.reason)));
  document.addEventListener(
      'securitypolicyviolation', (event) => errors.push('request: ' + event.blockedURI));
  const report = console.error;
  console.error = (...parts) => {
    errors.push(parts.join(' '));
    report(...parts);
  };
}

/** True if the scene's canvas has more than its background. */
function hasDrawing(scene) {
  if (!scene.isDrawn) return false;
  scene.draw();
  const canvas = scene.renderer.domElement;
  const copy = document.createElement('canvas');
  copy.width = 64;
  copy.height = 64;
  const context = copy.getContext('2d');
  context.drawImage(canvas, 0, 0, 64, 64);
  const pixels = new Uint32Array(context.getImageData(0, 0, 64, 64).data.buffer);
  return new Set(pixels).size > 8;
}

/**
 * `views`: {name: object with shown()}. `openedMs`, `sceneMs`: times from the request of the page
 * to its first frame and to that of the scene.
 */
export function runSelfTest(views, scene, cursor, openedMs, sceneMs) {
  const shownAt = (share) => {
    cursor.set(share * cursor.end);
    return Object.fromEntries(Object.entries(views).map(([name, view]) => [name, view.shown()]));
  };
  const early = shownAt(0.3);
  const late = shownAt(0.75);
  const again = shownAt(0.3);
  const moved = Object.keys(views).filter((name) => early[name] !== late[name]);
  const restored = Object.keys(views).filter((name) => early[name] === again[name]);
  document.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true}));
  const result = {
    views: Object.keys(views),
    moved,
    restored,
    errors,
    key_moves: Math.abs(cursor.time - Math.min(0.3 * cursor.end + 1, cursor.end)) < 1e-6,
    webgl: scene.isDrawn,
    drawn: hasDrawing(scene),
    requests: performance.getEntriesByType('resource').map((entry) => entry.name),
    opened_ms: openedMs,
    scene_ms: sceneMs,
  };
  document.body.append(element('pre', {id: 'self-test'}, JSON.stringify(result)));
}
