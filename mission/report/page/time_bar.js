// The slider, the play button, and the keys.

import {clock, element} from './format.js';
import {nextTheme} from './theme.js';

const RATES = [0.5, 1, 2, 5, 10, 30];
const VIEWS = [['all', Infinity], ['5 min', 300], ['1 min', 60], ['10 s', 10]];

export function themeButton() {
  const button = element(
      'button', {
        type: 'button',
        class: 'theme wide',
        title: 'Light, dark, or as the device is set (T)',
        onclick: () => {
          button.textContent = 'Theme: ' + nextTheme();
        }
      },
      'Theme: auto');
  return button;
}

export class TimeBar {
  /** `times`: ascending times of events, for the keys N and P. */
  constructor(host, cursor, view, times) {
    this.cursor = cursor;
    this.times = times;
    this.slider = element('input', {
      type: 'range',
      min: 0,
      max: cursor.end,
      step: 'any',
      value: 0,
      'aria-label': 'Time of the dive',
      oninput: () => cursor.set(Number(this.slider.value))
    });
    this.reading = element('output', {'aria-live': 'off'});
    this.playButton = element(
        'button', {type: 'button', title: 'Play or pause (space)', onclick: () => this.toggle()},
        element('span'), element('span', {class: 'wide'}));
    const rate = this.choice('Rate', RATES.map((value) => [`× ${value}`, value]), 1, (value) => {
      cursor.rate = value;
    });
    const range = this.choice('Show', VIEWS, 0, (value) => view.show(value));
    const jump = (direction, text, title) => element(
        'button', {type: 'button', class: 'wide', title, onclick: () => this.jump(direction)},
        text);
    const more = element(
        'button', {
          type: 'button',
          class: 'narrow',
          'aria-label': 'More controls',
          'aria-pressed': 'false',
          onclick: () => more.setAttribute('aria-pressed', String(host.classList.toggle('more')))
        },
        '⋯');
    host.append(
        this.playButton, rate, this.slider, this.reading, more,
        jump(-1, '◀ event', 'Previous event (P)'), jump(1, 'event ▶', 'Next event (N)'), range,
        themeButton());
    cursor.subscribe((t) => this.move(t));
    document.addEventListener('keydown', (event) => this.key(event));
  }

  choice(name, values, selected, onChange) {
    const select = element(
        'select', {
          class: 'wide',
          'aria-label': name,
          title: name,
          onchange: () => onChange(Number(select.value))
        },
        ...values.map(([text, value]) => element('option', {value}, `${name}: ${text}`)));
    select.selectedIndex = name === 'Rate' ? RATES.indexOf(selected) : selected;
    return select;
  }

  toggle() {
    if (this.cursor.isPlaying)
      this.cursor.pause();
    else
      this.cursor.play();
  }

  jump(direction) {
    const t = this.cursor.time;
    const next = direction > 0 ? this.times.find((time) => time > t + 1e-3) :
                                 this.times.filter((time) => time < t - 1e-3).pop();
    if (next !== undefined) this.cursor.set(next);
  }

  key(event) {
    const isIn = (selector) =>
        event.target instanceof Element && event.target.closest(selector) !== null;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target !== this.slider && isIn('input, select, textarea')) return;
    const step = event.shiftKey ? 10 : 1;
    const actions = {
      ArrowLeft: () => this.cursor.step(-step),
      ArrowRight: () => this.cursor.step(step),
      ',': () => this.cursor.step(-0.1),
      '.': () => this.cursor.step(0.1),
      Home: () => this.cursor.set(0),
      End: () => this.cursor.set(this.cursor.end),
      n: () => this.jump(1),
      p: () => this.jump(-1),
      t: () => document.querySelector('button.theme').click(),
      ' ': () => this.toggle(),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    // Space on a button presses that button.
    if (!action || (event.key === ' ' && isIn('button, summary'))) return;
    event.preventDefault();
    action();
  }

  move(t) {
    this.slider.value = t;
    this.slider.setAttribute('aria-valuetext', clock(t, 1));
    this.reading.textContent = `${clock(t, 1)} of ${clock(this.cursor.end, 0)}`;
    this.playButton.firstChild.textContent = this.cursor.isPlaying ? '❚❚' : '▶';
    this.playButton.lastChild.textContent = this.cursor.isPlaying ? ' Pause' : ' Play';
  }

  shown() {
    return this.slider.value;
  }
}
