// The report's data: JSON in the page, with long lists of numbers as little-endian base64
// (mission/report/page_data.h). Positions are in W: x east, y north, z up, 0 at the surface.

const ARRAY_TYPES = {
  f32: Float32Array,
  i16: Int16Array,
  u16: Uint16Array,
  u32: Uint32Array
};

function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

/** The value with every packed list in it as a typed array. */
function unpacked(value) {
  if (Array.isArray(value)) return value.map(unpacked);
  if (value === null || typeof value !== 'object') return value;
  const entries = Object.entries(value);
  if (entries.length === 1 && Object.hasOwn(ARRAY_TYPES, entries[0][0])) {
    return new ARRAY_TYPES[entries[0][0]](bytesOf(entries[0][1]).buffer);
  }
  return Object.fromEntries(entries.map(([key, member]) => [key, unpacked(member)]));
}

export function readReport() {
  return unpacked(JSON.parse(document.getElementById('report-data').textContent));
}

/** Index of the last of the ascending `times` at or before t; -1 before the first. */
export function lastIndexAt(times, t) {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t)
      low = middle + 1;
    else
      high = middle;
  }
  return low - 1;
}

/** The i-th point of a list x y z x y z ... */
export function pointAt(list, i) {
  return [list[3 * i], list[3 * i + 1], list[3 * i + 2]];
}

export function isKnown(value) {
  return value !== null && value !== undefined && Number.isFinite(value);
}
