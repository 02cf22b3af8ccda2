// Text and elements. Texts of the report are always set as text, never as HTML.

import {isKnown} from './data.js';

/**
   An element. Names of attributes that begin with "on" are events, those with "--" properties of
    its style; true and false switch an attribute. A child may be null.
 */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) {
      made.addEventListener(name.slice(2), value);
    } else if (name.startsWith('--')) {
      made.style.setProperty(name, value);
    } else if (value === true) {
      made.setAttribute(name, '');
    } else if (value !== false) {
      made.setAttribute(name, value);
    }
  }
  made.append(...children.filter((child) => child !== null));
  return made;
}

export function number(value, digits, unit = '') {
  if (!isKnown(value)) return 'not known';
  return value.toFixed(digits) + (unit ? '\u00a0' + unit : '');
}

/** A long name that may be broken after a slash or an underscore. */
export function breakable(name) {
  const parts = name.match(/[^/_]*[/_]?/g).filter(Boolean);
  return element(
      'span', {},
      ...parts.flatMap((part, i) => (i ? [document.createElement('wbr'), part] : [part])));
}

/** "1:57.02": minutes and seconds; hours where there are any. */
export function clock(seconds, digits = 2) {
  const sign = seconds < 0 ? '-' : '';
  const total = Math.round(Math.abs(seconds) * 10 ** digits) / 10 ** digits;
  const hours = Math.floor(total / 3600);
  const minutes = Math.floor(total / 60) % 60;
  const rest = (total % 60).toFixed(digits).padStart(digits ? digits + 3 : 2, '0');
  return sign + (hours ? hours + ':' + String(minutes).padStart(2, '0') : minutes) + ':' + rest;
}

/** "1 collision", "3 collisions" */
export function counted(count, noun) {
  return `${count} ${noun}${count === 1 ? '' : 's'}`;
}

/**
 * A piece of a curve (kind: '', 'dashed', 'dotted') or a patch ('fill') in a colour of style.css.
 */
export function swatch(style, kind = '') {
  return element(
      'span', {class: `swatch ${kind}`, '--swatch': `var(${style})`, 'aria-hidden': 'true'});
}
